/* prismarch: displaced surfaces as Embree geometries, without tessellation. C99 and C++.
 *
 *     #include <embree3/rtcore.h>    // or embree4; of the version that the library was built against
 *     #include <prismarch.h>
 *
 * A base mesh and a displacement map become a surface; a surface becomes an ordinary RTCGeometry, which the caller
 * commits, attaches, masks, instances, filters and releases by Embree's rules. Hits are those of a mesh: primID is the
 * base triangle (or quad), u and v its barycentric (or bilinear) coordinates, Ng the displaced surface's geometric normal.
 *
 * Every function that can fail returns a status, never aborts, never lets an exception or a panic out, and writes what is
 * wrong to *error where `error` is not NULL. On failure outputs are not written and nothing has changed.
 *
 * Handles of maps and surfaces are numbers that are looked up in the table of live ones before anything is read: a wild, stale or foreign
 * pointer, or a handle of the other kind, is PRISMARCH_ERROR_HANDLE in every function. None comes back in the life of the process. A
 * geometry is looked up in the same way where a function takes one. Devices, scenes and all other pointers are the caller's word: NULL and what
 * is not aligned is told, a wild one is not.
 *
 * Threads: functions on different handles may run at once. On one handle, those that take a pointer to const may run at
 * once with each other and with rays; the others (updates) must run alone, with no ray in flight and no commit running of any
 * scene that has a geometry of that surface or map. An update beside a ray, a commit or another call on the same surface is
 * PRISMARCH_ERROR_IN_FLIGHT, in every build, where one of prismarch's functions (a hit test, a box, the wait for a filter) ran while it was made;
 * it never takes effect under one. Retain and release may be called from any thread, also while another uses the handle: its call
 * ends well.
 *
 * Sizes: structs that callers fill and that may grow have a struct_size (prismarch_surface_desc). All others, those that prismarch fills among
 * them (prismarch_error, prismarch_point, prismarch_closest_point), stay as they are; what they lack will be another function's.
 */
#ifndef PRISMARCH_H
#define PRISMARCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Embree's handles, as rtcore.h declares them: include that first. */
#if !defined(RTC_VERSION_MAJOR) && !defined(PRISMARCH_WITHOUT_EMBREE)
#error "include <embree3/rtcore.h> or <embree4/rtcore.h> before <prismarch.h>, or define PRISMARCH_WITHOUT_EMBREE"
#endif
#ifdef PRISMARCH_WITHOUT_EMBREE
struct RTCDeviceTy;
struct RTCGeometryTy;
struct RTCSceneTy;
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define PRISMARCH_VERSION_MAJOR 0
#define PRISMARCH_VERSION_MINOR 1
#define PRISMARCH_VERSION_PATCH 0
/* major * 10000 + minor * 100 + patch, of this header. */
#define PRISMARCH_VERSION 100

/* A displacement map; counted references. */
typedef struct prismarch_map prismarch_map;
/* A displaced surface; counted references. It keeps its map. */
typedef struct prismarch_surface prismarch_surface;

/* What went wrong. */
typedef enum prismarch_status {
  PRISMARCH_OK = 0,
  PRISMARCH_ERROR_NULL = 1,      /* a pointer that must not be NULL */
  PRISMARCH_ERROR_HANDLE = 2,    /* not a live handle of this kind */
  PRISMARCH_ERROR_ARGUMENT = 3,  /* a number out of range, a size that does not fit, a struct_size of no known version */
  PRISMARCH_ERROR_DATA = 4,      /* buffers that hold NaN, indices out of range, triangles without area */
  PRISMARCH_ERROR_FILE = 5,      /* a picture that cannot be read */
  PRISMARCH_ERROR_EMBREE = 6,    /* Embree refused, or is of another major version than the library was built against */
  PRISMARCH_ERROR_IN_FLIGHT = 7, /* an update of something in use: by rays, commits, other calls */
  PRISMARCH_ERROR_PANIC = 8,     /* a fault of prismarch's; the handle can still be released */
  PRISMARCH_ERROR_MEMORY = 9,    /* no memory for what a caller's counts ask for */
  PRISMARCH_STATUS_FORCE_32_BIT = 0x7fffffff
} prismarch_status;

enum { PRISMARCH_MESSAGE_SIZE = 512 };

/* The text of a failure: one sentence, ended by a zero; what was found and what was expected. */
typedef struct prismarch_error {
  prismarch_status status;
  char message[PRISMARCH_MESSAGE_SIZE];
} prismarch_error;

/* PRISMARCH_VERSION of the library that is loaded. */
uint32_t prismarch_version(void);
/* RTC_VERSION of the Embree headers that it was built against, as major * 10000 + minor * 100 + patch. */
uint32_t prismarch_embree_version(void);

/* Maps ---------------------------------------------------------------------------------------------- */

typedef enum prismarch_texel {
  PRISMARCH_TEXEL_U8 = 0,  /* height = texel / 255 */
  PRISMARCH_TEXEL_U16 = 1, /* height = texel / 65535 */
  PRISMARCH_TEXEL_F16 = 2, /* IEEE half; kept as float */
  PRISMARCH_TEXEL_F32 = 3,
  PRISMARCH_TEXEL_FORCE_32_BIT = 0x7fffffff
} prismarch_texel;

/* Outside [0, 1] of texture space. */
typedef enum prismarch_wrap {
  PRISMARCH_WRAP_REPEAT = 0,
  PRISMARCH_WRAP_CLAMP = 1,
  PRISMARCH_WRAP_MIRROR = 2,
  PRISMARCH_WRAP_FORCE_32_BIT = 0x7fffffff
} prismarch_wrap;

/* Texels in the caller's memory; read during the call only. */
typedef struct prismarch_texels {
  const void *data;      /* the first texel of row 0 */
  prismarch_texel format;
  ptrdiff_t texel_stride; /* bytes from one texel to the next in a row; 0: tightly packed */
  ptrdiff_t row_stride;   /* bytes from one row to the next; 0: rows follow each other. Negative where rows are upside down */
} prismarch_texels;

/* A map of width x height texels (1 .. 32768 each). Row 0 is the bottom: v = 0 is its lower edge, texel i's centre at
 * (i + 0.5) / width. For pictures whose row 0 is the top let `data` be the last row and `row_stride` negative. */
prismarch_status prismarch_map_create(uint32_t width, uint32_t height, const prismarch_texels *texels, prismarch_wrap wrap,
                                      prismarch_map **map, prismarch_error *error);
/* The same from a picture file (docs/scene.md, Pictures) in its own precision (its bottom row is row 0). `channel`: NULL for luminance, or
 * R, G, B, A, the name of an EXR channel or the number of a band, from 1. Texels without data are an error. */
prismarch_status prismarch_map_load(const char *path, const char *channel, prismarch_wrap wrap, prismarch_map **map,
                                    prismarch_error *error);
prismarch_status prismarch_map_size(const prismarch_map *map, uint32_t *width, uint32_t *height, prismarch_error *error);
/* Replaces the rectangle with lower left texel (x, y). The format is the map's own (for maps made of halves, halves or floats).
 * Surfaces that have the map show it in the next ray. *commit_needed (may be NULL): whether bounds have grown, so that
 * the geometries over the map need rtcCommitGeometry and their scenes rtcCommitScene before the next ray. */
prismarch_status prismarch_map_update(prismarch_map *map, uint32_t x, uint32_t y, uint32_t width, uint32_t height,
                                      const prismarch_texels *texels, bool *commit_needed, prismarch_error *error);
prismarch_status prismarch_map_retain(prismarch_map *map);
/* NULL is allowed. The last release frees it, once no surface has it and the calls have ended that use it. One too many is
 * PRISMARCH_ERROR_HANDLE. */
prismarch_status prismarch_map_release(prismarch_map *map);

/* Surfaces ------------------------------------------------------------------------------------------ */

/* An array in the caller's memory, as rtcSetSharedGeometryBuffer takes it. All are read during the call only: the base
 * mesh is small, and kept in 108 bytes per triangle. */
typedef struct prismarch_buffer {
  const void *data;   /* NULL: there is none */
  size_t offset;      /* bytes to the first item */
  size_t stride;      /* bytes from one item to the next; 0: tightly packed */
} prismarch_buffer;

typedef enum prismarch_primitive {
  PRISMARCH_TRIANGLES = 0, /* three uint32_t each */
  PRISMARCH_QUADS = 1,     /* four: the triangles (0, 1, 3) and (2, 3, 1), u and v as in Embree's quads */
  PRISMARCH_PRIMITIVE_FORCE_32_BIT = 0x7fffffff
} prismarch_primitive;

typedef enum prismarch_march {
  PRISMARCH_MARCH_EXACT = 0,
  PRISMARCH_MARCH_UNIFORM = 1, /* the paper's, in steps of `step` texels: to compare with */
  PRISMARCH_MARCH_FORCE_32_BIT = 0x7fffffff
} prismarch_march;

typedef enum prismarch_seams {
  PRISMARCH_SEAMS_OPEN = 0,
  PRISMARCH_SEAMS_CLOSED = 1, /* walls at seams and borders; a hit there has a primID of the primitives' number and above */
  PRISMARCH_SEAMS_FORCE_32_BIT = 0x7fffffff
} prismarch_seams;

typedef enum prismarch_edit_bounds {
  PRISMARCH_EDIT_BOUNDS_TIGHT = 0, /* fastest rays; an edit may need a commit */
  PRISMARCH_EDIT_BOUNDS_RANGE = 1, /* room for all that an integer map can hold: edits never need one */
  PRISMARCH_EDIT_BOUNDS_FORCE_32_BIT = 0x7fffffff
} prismarch_edit_bounds;

/* A vertex array at one time. */
typedef struct prismarch_vertices {
  prismarch_buffer positions; /* three floats each */
  prismarch_buffer normals;   /* three floats each, of any length; without data smooth ones are computed */
} prismarch_vertices;

/* Filled by prismarch_surface_desc_init; then set what is wanted. */
typedef struct prismarch_surface_desc {
  /* sizeof(prismarch_surface_desc) as the caller was compiled. An older one is taken, and what it lacks has its default; a newer one is, if
   * all is zero that the library does not know. */
  size_t struct_size;

  uint32_t vertex_count;
  uint32_t primitive_count;
  prismarch_primitive primitive;
  prismarch_buffer indices;
  prismarch_vertices vertices;
  prismarch_buffer texcoords; /* two floats per vertex; v points up */

  prismarch_map *map; /* retained */
  float scale;        /* D = scale (height - midlevel), world units along the unit interpolated normal; 1 */
  float midlevel;     /* 0 */

  prismarch_march march;
  float step; /* PRISMARCH_MARCH_UNIFORM: texels, above 0; 1 */
  prismarch_seams seams;
  prismarch_edit_bounds edit_bounds;
  /* Level of detail: twice how far a hit may be from the exact one, as a part of its t; about the angle of a pixel. 0: exact. */
  float lod_spread;

  /* Motion blur: time steps evenly spaced over [0, 1], linear between them. `vertices` is the first, later_steps has the other
   * time_step_count - 1. 1: nothing moves. At most 129; needs the exact march, open seams, no level of detail. */
  uint32_t time_step_count;
  const prismarch_vertices *later_steps;

  /* Version 0.1.0 ends here. ------------------------------------------------ */

  /* Whether filters will be set for geometries of the surface (rtcSetGeometryIntersectFilterFunction, ...OccludedFilterFunction), which
   * prismarch cannot see. false lets occlusion rays end at any hit, and packets be met without a look at filters; a geometry's filter is then never
   * asked. (The filter of a call's context with Embree 3 is seen, and asked all the same.) true */
  bool has_filter;
  uint8_t reserved[7]; /* 0 */
} prismarch_surface_desc;

/* Fills the `size` bytes of *desc with the defaults: sizeof(prismarch_surface_desc) as the caller was compiled. */
prismarch_status prismarch_surface_desc_init_sized(prismarch_surface_desc *desc, size_t size);
/* C and C++ that include this header pass their size. The function itself, for programs that were compiled before there were sizes and for
 * bindings that call it by name, fills what version 0.1.0 had and writes nothing behind it. */
prismarch_status prismarch_surface_desc_init(prismarch_surface_desc *desc);
#define prismarch_surface_desc_init(desc) prismarch_surface_desc_init_sized((desc), sizeof(prismarch_surface_desc))

/* Triangles without area are never hit; primIDs stay the caller's. Embree takes no coordinates beyond 1.844e18: a surface that reaches
 * further is PRISMARCH_ERROR_DATA, here and in updates. */
prismarch_status prismarch_surface_create(const prismarch_surface_desc *desc, prismarch_surface **surface,
                                          prismarch_error *error);
/* Moves the vertices of a time step (0 where nothing moves), as many as there were. Geometries of the surface need rtcCommitGeometry
 * and their scenes rtcCommitScene; build quality RTC_BUILD_QUALITY_REFIT will do. *commit_needed may be NULL. */
prismarch_status prismarch_surface_update_vertices(prismarch_surface *surface, uint32_t time_step,
                                                   const prismarch_vertices *vertices, bool *commit_needed,
                                                   prismarch_error *error);
/* Whether something failed while rays were traced or bounds asked since the last call, when nothing could be returned: such rays miss. */
prismarch_status prismarch_surface_check(prismarch_surface *surface, prismarch_error *error);
/* Bytes of the surface without its map. */
prismarch_status prismarch_surface_bytes(const prismarch_surface *surface, size_t *bytes, prismarch_error *error);
prismarch_status prismarch_surface_retain(prismarch_surface *surface);
/* As prismarch_map_release. Where prismarch_geometry_keeps_surface() the surface may be released before its geometries are. */
prismarch_status prismarch_surface_release(prismarch_surface *surface);

/* Interpolation ------------------------------------------------------------------------------------- */

/* The displaced surface at (u, v). Vectors of three floats, object space. */
typedef struct prismarch_point {
  float position[3];
  float base_position[3];
  float geometric_normal[3]; /* unit, of the displaced surface */
  float smooth_normal[3];    /* unit, for shading */
  float dPdu[3], dPdv[3];    /* of the displaced position */
  float texcoord[2];
  float displacement; /* world units along the unit interpolated normal */
} prismarch_point;

/* What rtcInterpolate gives of the meshes that the surface replaces; primID, u, v as in hits. `time` in [0, 1]; 0 where nothing moves. */
prismarch_status prismarch_interpolate(const prismarch_surface *surface, uint32_t prim_id, float u, float v, float time,
                                       prismarch_point *point, prismarch_error *error);
/* For n points; `valid` as rtcInterpolateN's: NULL, or -1 for each that is asked for. The first that cannot be given ends it. */
prismarch_status prismarch_interpolate_n(const prismarch_surface *surface, const int *valid, const uint32_t *prim_ids,
                                         const float *u, const float *v, uint32_t n, float time, prismarch_point *points,
                                         prismarch_error *error);

/* Embree -------------------------------------------------------------------------------------------- */

/* Whether geometries keep their surface until Embree destroys them: then everything may be released in any order. That takes notice of a
 * geometry's end, which there is on Linux with glibc. Elsewhere (macOS, musl) it is false, and the rule is plain: a surface must not be
 * released for the last time before all scenes and references of the caller's have let go of its geometries. */
bool prismarch_geometry_keeps_surface(void);
/* A new geometry of the device, with one reference that the caller owns; NULL on failure is never written. Not yet committed.
 *
 * Free for the caller: masks, build quality, intersection and occlusion filters, attaching to any number of scenes, instancing,
 * rtcRetainGeometry, rtcReleaseGeometry. Set by prismarch and not to be changed: the primitive count, time step count, the
 * bounds, intersect, occluded and point query functions, and Embree's user data pointer; for your own see below.
 *
 * Rays whose origin or direction is NaN or beyond 1.844e18 meet nothing, if Embree lets them get here: builds with assertions, Debian's among
 * them, end the process in rtcIntersect and rtcOccluded before any geometry is asked. Such rays are the caller's to keep back. */
prismarch_status prismarch_geometry_create(struct RTCDeviceTy *device, prismarch_surface *surface,
                                           struct RTCGeometryTy **geometry, prismarch_error *error);
/* In place of rtcSetGeometryUserData and rtcGetGeometryUserData. Filters get this pointer as args->geometryUserPtr. A geometry that prismarch has
 * not made, or that was destroyed, is PRISMARCH_ERROR_HANDLE, and has the data NULL (where prismarch_geometry_keeps_surface() is false, a
 * destroyed one only after its surface). */
prismarch_status prismarch_geometry_set_user_data(struct RTCGeometryTy *geometry, void *data, prismarch_error *error);
void *prismarch_geometry_user_data(struct RTCGeometryTy *geometry);

/* The nearest point of the surfaces in a scene. */
typedef struct prismarch_closest_point {
  float distance;
  float position[3];
  float u, v;
  uint32_t prim_id, geom_id;
} prismarch_closest_point;

/* rtcPointQuery over the surfaces attached to a committed scene itself (instances in it are not entered; other geometries are not asked).
 * *found: whether there is a point no further than `radius`, which may be infinite; only then *point is written. A scene that was not committed
 * since it was last changed is PRISMARCH_ERROR_EMBREE (the device's error function is told, too); a wild one cannot be told.
 * Positions beyond 1.844e18 are PRISMARCH_ERROR_ARGUMENT. */
prismarch_status prismarch_closest(struct RTCSceneTy *scene, const float position[3], float radius, float time, bool *found,
                                   prismarch_closest_point *point, prismarch_error *error);

/* The same for one primitive of Embree's: for your own RTCPointQueryFunction, which rtcPointQuery calls with each primitive near the
 * point. Its args->primID is, for a geometry of prismarch's, up to eight base triangles; pass it as `primitive`, args->query's x, y, z,
 * radius and time, and args->context->inst2world[instStackSize - 1] (sixteen floats) as `to_world`, or NULL where the stack is empty. Where
 * *found, shrink args->query->radius to point->distance and return true. Distances are those of the world, under any transform.
 * point->geom_id is RTC_INVALID_GEOMETRY_ID: you have it in args. */
prismarch_status prismarch_surface_closest(const prismarch_surface *surface, uint32_t primitive, const float position[3],
                                           float radius, float time, const float to_world[16], bool *found,
                                           prismarch_closest_point *point, prismarch_error *error);

#ifdef __cplusplus
}
#endif

#endif
