/* What prismarch asks of Embree, in words that do not depend on Embree's version.
 *
 * This header includes nothing of Embree; embree.h alone does, for the files of this directory. Every call that can fail
 * reports through the device's error function, on the calling thread, before it returns.
 */
#ifndef PRISMARCH_SHIM_H
#define PRISMARCH_SHIM_H

#include <stdbool.h>
#include <stdint.h>

/* Instance levels a hit reports; the library may have more, but is asked for no more. */
#define PM_INSTANCE_LEVELS 1

/* Rays of a packet. */
#define PM_LANES 8

/* No geometry, no instance. */
#define PM_INVALID_ID 0xffffffffu

typedef struct pm_device pm_device;
typedef struct pm_scene pm_scene;
typedef struct pm_geometry pm_geometry;

/* Embree's own numbers. */
enum {
  PM_ERROR_NONE = 0,
  PM_ERROR_UNKNOWN = 1,
  PM_ERROR_INVALID_ARGUMENT = 2,
  PM_ERROR_INVALID_OPERATION = 3,
  PM_ERROR_OUT_OF_MEMORY = 4,
  PM_ERROR_UNSUPPORTED_CPU = 5,
  PM_ERROR_CANCELLED = 6
};

enum { PM_QUALITY_LOW = 0, PM_QUALITY_MEDIUM = 1, PM_QUALITY_HIGH = 2, PM_QUALITY_REFIT = 3 };

enum { PM_SCENE_DYNAMIC = 1, PM_SCENE_COMPACT = 2, PM_SCENE_ROBUST = 4 };

/* Word for word Embree's RTCRay: t in (tnear, tfar) along the unnormalised direction. */
typedef struct pm_ray {
  _Alignas(16) float org[3];
  float tnear;
  float dir[3];
  float time;
  float tfar;
  uint32_t mask;
  uint32_t id;
  uint32_t flags;
} pm_ray;

/* Eight rays, word for word Embree's RTCRay8. */
typedef struct pm_ray8 {
  _Alignas(32) float org[3][PM_LANES];
  float tnear[PM_LANES];
  float dir[3][PM_LANES];
  float time[PM_LANES];
  float tfar[PM_LANES];
  uint32_t mask[PM_LANES];
  uint32_t id[PM_LANES];
  uint32_t flags[PM_LANES];
} pm_ray8;

/* Where a ray meets one primitive. ng need not be of unit length; prim is the primID to report, which need not
 * be the number of the primitive that was tested: one primitive may hold many. */
typedef struct pm_hit {
  float t, u, v;
  float ng[3];
  uint32_t prim;
} pm_hit;

/* Where a ray meets a scene. ng is in object space, as the hit test or Embree gave it. */
typedef struct pm_scene_hit {
  pm_hit at;
  uint32_t geom;
  uint32_t inst[PM_INSTANCE_LEVELS];
} pm_scene_hit;

/* A point whose nearest neighbour no further than `radius` is looked for, both in the world; `to_world` places what is
 * asked: 4 columns of 3. */
typedef struct pm_point_query {
  float point[3];
  float radius, time;
  float to_world[12];
} pm_point_query;

/* The nearest point: in the world, but for prim, u and v. */
typedef struct pm_closest {
  float distance;
  float point[3];
  float u, v;
  uint32_t prim, geom;
  uint32_t inst[PM_INSTANCE_LEVELS];
} pm_closest;

/* The test of one primitive of a user geometry. Called from many threads at once; must not unwind.
 *   bounds     writes min x y z, max x y z at a time step, wide enough for any rounding in a box test; between two steps
 *              what is hit lies in the linear interpolation of both boxes.
 *   intersect  the first hit with t in (tnear, tfar); fills `hit` and returns true, or returns false.
 *   occluded   whether there is one.
 * The same for the lanes of a packet whose bits are set in `valid`, the others hold anything; either may be NULL,
 * then lanes are asked one by one, as they are wherever there is a filter:
 *   intersect8  fills hits[i] and sets bit i of the result for every lane i that hits.
 *   occluded8   sets bit i for every lane i that is occluded.
 * May be NULL, then nothing is near the geometry, or nobody is told:
 *   closest     the nearest point no further than the radius; fills `found`, but for its geom and inst, and returns true.
 *   begin_filter, end_filter  called around a filter, on its thread; what the first returns is given to the second. */
typedef struct pm_hit_test {
  void (*bounds)(const void *user, uint32_t prim, uint32_t step, float out[6]);
  bool (*intersect)(const void *user, uint32_t prim, const pm_ray *ray, pm_hit *hit);
  bool (*occluded)(const void *user, uint32_t prim, const pm_ray *ray);
  uint32_t (*intersect8)(const void *user, uint32_t prim, const pm_ray8 *rays, uint32_t valid, pm_hit hits[PM_LANES]);
  uint32_t (*occluded8)(const void *user, uint32_t prim, const pm_ray8 *rays, uint32_t valid);
  bool (*closest)(const void *user, uint32_t prim, const pm_point_query *query, pm_closest *found);
  uint32_t (*begin_filter)(const void *user);
  void (*end_filter)(const void *user, uint32_t begun);
} pm_hit_test;

/* A regular grid of width x height vertices, `stride` vertices from one row to the next: word for word RTCGrid. */
typedef struct pm_grid {
  uint32_t first, stride;
  uint16_t width, height;
} pm_grid;

/* Whether a candidate hit counts; ray->tfar is the candidate's t. A rejected one lets the ray go on. */
typedef bool (*pm_filter)(const void *user, const pm_ray *ray, const pm_scene_hit *candidate);

/* `message` is valid during the call only. */
typedef void (*pm_error_function)(const void *user, int code, const char *message);

/* `bytes` are (post) or are about to be (!post) allocated, or freed when negative. False refuses. */
typedef bool (*pm_memory_function)(const void *user, int64_t bytes, bool post);

/* Device ------------------------------------------------------------------------------------------ */

/* RTC_VERSION of the headers: major * 10000 + minor * 100 + patch. */
uint32_t pm_version_of_headers(void);

/* NULL on failure, with the reason in *error. `config` as for rtcNewDevice. `user` must outlive the
 * device and all that was made from it. */
pm_device *pm_device_new(const char *config, const void *user, pm_error_function on_error,
                         pm_memory_function on_memory, int *error);
void pm_device_free(pm_device *device);
/* Of the library that is loaded, in the form of pm_version_of_headers. */
uint32_t pm_device_version(const pm_device *device);
/* Whether the library was built with ray masks and with filter functions. */
bool pm_device_has_masks(const pm_device *device);
bool pm_device_has_filters(const pm_device *device);

/* Geometry ---------------------------------------------------------------------------------------- */

/* Time steps are evenly spaced over the times [0, 1]; 1 for what stands still. All return NULL on failure. A new geometry is seen by every ray (mask of all bits).
 * A geometry must be freed after the scenes it was attached to: Embree calls it until then. */
pm_geometry *pm_geometry_new_user(const pm_device *device, const pm_hit_test *test, const void *user,
                                  uint32_t primitives, uint32_t time_steps);
/* Both arrays are shared, not copied: vertices as x y z with 4 readable bytes after the last one. */
pm_geometry *pm_geometry_new_triangles(const pm_device *device, const float *vertices, uint32_t vertex_count,
                                       const uint32_t *indices, uint32_t triangle_count);
/* The same for grids, whose cells are two triangles each. */
pm_geometry *pm_geometry_new_grids(const pm_device *device, const float *vertices, uint32_t vertex_count,
                                   const pm_grid *grids, uint32_t grid_count);
/* `transform`: object to world, 4 columns of 3. */
pm_geometry *pm_geometry_new_instance(const pm_device *device, pm_scene *scene, const float transform[12]);
void pm_geometry_free(pm_geometry *geometry);

/* Another test for a user geometry. */
void pm_geometry_set_test(pm_geometry *geometry, const pm_hit_test *test, const void *user, uint32_t primitives,
                          uint32_t time_steps);
/* The vertices of triangles or grids have moved, perhaps to another array of the same length. */
void pm_geometry_set_vertices(pm_geometry *geometry, const float *vertices, uint32_t vertex_count);
void pm_geometry_set_mask(pm_geometry *geometry, uint32_t mask);
/* Sets the intersection and the occlusion filter; not for instances. */
void pm_geometry_set_filter(pm_geometry *geometry, pm_filter filter, const void *user);
void pm_geometry_set_quality(pm_geometry *geometry, int quality);
/* Ends every change; needed before the commit of the scene. */
void pm_geometry_commit(pm_geometry *geometry);

/* Scene ------------------------------------------------------------------------------------------- */

pm_scene *pm_scene_new(const pm_device *device, int quality, int flags);
void pm_scene_free(pm_scene *scene);
void pm_scene_attach(pm_scene *scene, pm_geometry *geometry, uint32_t id);
void pm_scene_commit(pm_scene *scene);
/* min x y z, max x y z of a committed scene; inverted when it is empty. */
void pm_scene_bounds(const pm_scene *scene, float out[6]);

/* All ask a committed scene, from any number of threads. */
bool pm_intersect1(const pm_scene *scene, const pm_ray *ray, pm_scene_hit *hit);
bool pm_occluded1(const pm_scene *scene, const pm_ray *ray);

/* The same for the lanes whose bits are set in `valid`; the others may hold anything. Bit i of the result tells of
 * lane i; hits[i] is written where it is set. `coherent`: the rays go the same way from about the same place, which
 * Embree then relies on for speed alone. */
uint32_t pm_intersect8(const pm_scene *scene, const pm_ray8 *rays, uint32_t valid, bool coherent,
                       pm_scene_hit hits[PM_LANES]);
uint32_t pm_occluded8(const pm_scene *scene, const pm_ray8 *rays, uint32_t valid, bool coherent);

/* The nearest point of the user geometries, no further than `radius`. */
bool pm_closest1(const pm_scene *scene, const float point[3], float radius, float time, pm_closest *found);

/* A caller's own device and scenes -------------------------------------------------------------------- */

/* Here `device`, `geometry` and `scene` are Embree's own handles. */

/* Major version of the Embree that made the device; 0 if it cannot be told. */
uint32_t pm_foreign_major(void *device);
/* Of a geometry on a caller's device, what belongs to it here. */
typedef struct pm_foreign pm_foreign;
/* Whether this build can notice the end of a geometry at all. */
bool pm_foreign_can_watch(void);
/* A user geometry of the device, with one reference; NULL on failure. `has_filter`: callers may set filters. Where the geometry is
 * watched ending(geometry) is called when Embree begins to destroy it, and after that gone(user); then the pm_foreign is no more. Where it
 * is not, pm_foreign_free calls gone(user). */
pm_foreign *pm_foreign_new(void *device, const pm_hit_test *test, void *user, uint32_t primitives, uint32_t time_steps,
                           bool has_filter, void (*ending)(const void *geometry), void (*gone)(void *user));
void *pm_foreign_geometry(const pm_foreign *foreign);
bool pm_foreign_is_watched(const pm_foreign *foreign);
/* Of a geometry that is not watched, and that nothing traces or commits any more. */
void pm_foreign_free(pm_foreign *foreign);
/* What filters get as their user data; NULL at first. */
void pm_foreign_set_caller_data(pm_foreign *foreign, void *data);
void *pm_foreign_caller_data(const pm_foreign *foreign);
void pm_foreign_release(void *geometry);
/* Commits and attaches: the geomID. */
uint32_t pm_foreign_attach(void *scene, void *geometry);
/* Whether a scene is committed, and unchanged since; where it is not Embree reports an error, too. */
bool pm_foreign_is_committed(void *scene);
/* pm_closest1 in a scene whose instances are not entered. */
bool pm_closest_in(void *scene, const float point[3], float radius, float time, pm_closest *found);

#endif
