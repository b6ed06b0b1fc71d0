/* Devices, geometries, scenes and rays: what differs between Embree 3 and 4 differs here. */
#include "embree.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(RTC_VERSION_MAJOR == PM_EMBREE_MAJOR, "headers of another Embree");
_Static_assert(RTC_MAX_INSTANCE_LEVEL_COUNT >= PM_INSTANCE_LEVELS, "Embree was built without instances");
_Static_assert(sizeof(pm_ray) == sizeof(struct RTCRay) && _Alignof(pm_ray) == _Alignof(struct RTCRay) &&
                   offsetof(pm_ray, dir) == offsetof(struct RTCRay, dir_x) &&
                   offsetof(pm_ray, tfar) == offsetof(struct RTCRay, tfar) &&
                   offsetof(pm_ray, mask) == offsetof(struct RTCRay, mask) &&
                   offsetof(pm_ray, id) == offsetof(struct RTCRay, id),
               "pm_ray must be RTCRay");
_Static_assert(sizeof(pm_ray8) == sizeof(struct RTCRay8) && _Alignof(pm_ray8) == _Alignof(struct RTCRay8) &&
                   offsetof(pm_ray8, dir) == offsetof(struct RTCRay8, dir_x) &&
                   offsetof(pm_ray8, tfar) == offsetof(struct RTCRay8, tfar) &&
                   offsetof(pm_ray8, mask) == offsetof(struct RTCRay8, mask) &&
                   offsetof(pm_ray8, id) == offsetof(struct RTCRay8, id),
               "pm_ray8 must be RTCRay8");
_Static_assert((int)PM_ERROR_INVALID_ARGUMENT == (int)RTC_ERROR_INVALID_ARGUMENT &&
                   (int)PM_ERROR_INVALID_OPERATION == (int)RTC_ERROR_INVALID_OPERATION &&
                   (int)PM_ERROR_OUT_OF_MEMORY == (int)RTC_ERROR_OUT_OF_MEMORY &&
                   (int)PM_ERROR_UNSUPPORTED_CPU == (int)RTC_ERROR_UNSUPPORTED_CPU &&
                   (int)PM_ERROR_CANCELLED == (int)RTC_ERROR_CANCELLED,
               "error codes");
_Static_assert((int)PM_QUALITY_LOW == (int)RTC_BUILD_QUALITY_LOW &&
                   (int)PM_QUALITY_MEDIUM == (int)RTC_BUILD_QUALITY_MEDIUM &&
                   (int)PM_QUALITY_HIGH == (int)RTC_BUILD_QUALITY_HIGH &&
                   (int)PM_QUALITY_REFIT == (int)RTC_BUILD_QUALITY_REFIT,
               "build qualities");
_Static_assert((int)PM_SCENE_DYNAMIC == (int)RTC_SCENE_FLAG_DYNAMIC &&
                   (int)PM_SCENE_COMPACT == (int)RTC_SCENE_FLAG_COMPACT &&
                   (int)PM_SCENE_ROBUST == (int)RTC_SCENE_FLAG_ROBUST,
               "scene flags");
_Static_assert(sizeof(pm_grid) == sizeof(struct RTCGrid) &&
                   offsetof(pm_grid, stride) == offsetof(struct RTCGrid, stride) &&
                   offsetof(pm_grid, height) == offsetof(struct RTCGrid, height),
               "pm_grid must be RTCGrid");
_Static_assert(PM_INVALID_ID == RTC_INVALID_GEOMETRY_ID, "invalid id");

struct pm_device {
  RTCDevice rtc;
  const void *user;
  pm_error_function on_error;
  pm_memory_function on_memory;
};

/* Lanes ------------------------------------------------------------------------------------------- */

/* Embree hands over rays and hits as N lanes of 4-byte words, word-major; for N = 1 that is the plain struct. */

enum {
  RAY_WORDS = sizeof(struct RTCRay) / 4,
#ifdef RTC_GEOMETRY_INSTANCE_ARRAY
  HIT_WORDS = 7 + 2 * RTC_MAX_INSTANCE_LEVEL_COUNT,
#else
  HIT_WORDS = 7 + RTC_MAX_INSTANCE_LEVEL_COUNT,
#endif
  TFAR_WORD = offsetof(struct RTCRay, tfar) / 4
};
_Static_assert(sizeof(struct RTCHit) >= 4 * HIT_WORDS && offsetof(struct RTCHit, instID) == 4 * 7, "RTCHit");

static inline void load_words(void *out, const void *lanes, unsigned words, unsigned n, unsigned i) {
  if (n == 1) {
    memcpy(out, lanes, 4 * (size_t)words);
    return;
  }
  for (unsigned w = 0; w < words; w++)
    memcpy((char *)out + 4 * w, (const char *)lanes + 4 * ((size_t)w * n + i), 4);
}

static inline void store_words(void *lanes, const void *in, unsigned words, unsigned n, unsigned i) {
  if (n == 1) {
    memcpy(lanes, in, 4 * (size_t)words);
    return;
  }
  for (unsigned w = 0; w < words; w++)
    memcpy((char *)lanes + 4 * ((size_t)w * n + i), (const char *)in + 4 * w, 4);
}

static inline void store_tfar(void *lanes, float tfar, unsigned n, unsigned i) {
  memcpy((char *)lanes + 4 * ((size_t)TFAR_WORD * n + i), &tfar, 4);
}

/* Embree 4 wants to be told which lanes hit; Embree 3 looks at tfar alone. */
static inline void report(int *valid, bool hit) {
#if PM_EMBREE_MAJOR >= 4
  *valid = hit ? -1 : 0;
#else
  (void)valid;
  (void)hit;
#endif
}

/* User geometry ----------------------------------------------------------------------------------- */

typedef void (*invoke_filter)(const void *args, const struct RTCFilterFunctionNArguments *candidate);

static void invoke_intersect_filter(const void *args, const struct RTCFilterFunctionNArguments *candidate) {
#if PM_EMBREE_MAJOR == 3
  rtcFilterIntersection((const struct RTCIntersectFunctionNArguments *)args, candidate);
#else
  rtcInvokeIntersectFilterFromGeometry((const struct RTCIntersectFunctionNArguments *)args, candidate);
#endif
}

static void invoke_occluded_filter(const void *args, const struct RTCFilterFunctionNArguments *candidate) {
#if PM_EMBREE_MAJOR == 3
  rtcFilterOcclusion((const struct RTCOccludedFunctionNArguments *)args, candidate);
#else
  rtcInvokeOccludedFilterFromGeometry((const struct RTCOccludedFunctionNArguments *)args, candidate);
#endif
}

/* Without a filter, whether a ray is occluded needs no hit, and the first hit of a primitive is final. */
static inline bool has_filter(const struct pm_geometry *g, const query_context *context) {
#if PM_EMBREE_MAJOR == 3
  return g->filter || context->filter;
#else
  (void)context;
  return g->filter;
#endif
}

static inline void fill_hit(struct RTCHit *hit, const pm_hit *at, unsigned geom,
                            const query_context *context) {
  hit->Ng_x = at->ng[0];
  hit->Ng_y = at->ng[1];
  hit->Ng_z = at->ng[2];
  hit->u = at->u;
  hit->v = at->v;
  hit->primID = at->prim;
  hit->geomID = geom;
  memcpy(hit->instID, context->instID, sizeof hit->instID);
#ifdef RTC_GEOMETRY_INSTANCE_ARRAY
  memcpy(hit->instPrimID, context->instPrimID, sizeof hit->instPrimID);
#endif
}

/* A surface crosses one primitive a few times at most; a hit test gone wrong must not hang the ray. */
enum { MAX_CANDIDATES = 1024 };

/* What both kinds of callback arguments share. */
typedef struct query {
  const struct pm_geometry *geometry;
  const void *args;
  query_context *context;
  invoke_filter invoke;
  unsigned prim, geom;
} query;

/* The first hit that the filters accept: then ray->tfar is its t. A rejected one moves tnear up to it, so
 * that the crossings behind it are found. */
static inline bool first_accepted(const query *q, pm_ray *ray, struct RTCHit *hit) {
  const float limit = ray->tfar;
  for (int k = 0; k < MAX_CANDIDATES; k++) {
    pm_hit at;
    if (!q->geometry->test.intersect(q->geometry->test_user, q->prim, ray, &at))
      return false;
    if (!(at.t > ray->tnear && at.t < limit))
      return false;
    fill_hit(hit, &at, q->geom, q->context);
    ray->tfar = at.t;
    int valid = -1;
    struct RTCFilterFunctionNArguments candidate = {
        .valid = &valid,
        .geometryUserPtr = (void *)q->geometry,
        .context = q->context,
        .ray = (struct RTCRayN *)ray,
        .hit = (struct RTCHitN *)hit,
        .N = 1,
    };
    q->invoke(q->args, &candidate);
    if (valid == -1)
      return true;
    ray->tnear = at.t;
    ray->tfar = limit;
  }
  return false;
}

static inline void intersect_lanes(const struct RTCIntersectFunctionNArguments *args, unsigned n) {
  const query q = {args->geometryUserPtr, args,         args->context,
                   invoke_intersect_filter, args->primID, args->geomID};
  char *rays = (char *)args->rayhit;
  char *hits = rays + (size_t)sizeof(struct RTCRay) * n;
  for (unsigned i = 0; i < n; i++) {
    if (args->valid[i] != -1)
      continue;
    pm_ray ray;
    struct RTCHit hit;
    load_words(&ray, rays, RAY_WORDS, n, i);
    const bool found = first_accepted(&q, &ray, &hit);
    if (found) {
      store_tfar(rays, ray.tfar, n, i);
      store_words(hits, &hit, HIT_WORDS, n, i);
    }
    report(&args->valid[i], found);
  }
}

static inline void occluded_lanes(const struct RTCOccludedFunctionNArguments *args, unsigned n) {
  const query q = {args->geometryUserPtr, args,         args->context,
                   invoke_occluded_filter, args->primID, args->geomID};
  const bool filtered = has_filter(q.geometry, args->context);
  for (unsigned i = 0; i < n; i++) {
    if (args->valid[i] != -1)
      continue;
    pm_ray ray;
    struct RTCHit hit;
    load_words(&ray, args->ray, RAY_WORDS, n, i);
    const bool found = filtered ? first_accepted(&q, &ray, &hit)
                                : q.geometry->test.occluded(q.geometry->test_user, q.prim, &ray);
    if (found)
      store_tfar(args->ray, -INFINITY, n, i);
    report(&args->valid[i], found);
  }
}

/* Up to PM_LANES neighbouring lanes of N. */
typedef struct group {
  int *valid;
  unsigned first, count;
  uint32_t bits; /* the valid ones */
} group;

static inline group group_at(int *valid, unsigned n, unsigned first) {
  group g = {valid + first, first, n - first < PM_LANES ? n - first : PM_LANES, 0};
  for (unsigned i = 0; i < g.count; i++)
    g.bits |= (uint32_t)(g.valid[i] == -1) << i;
  return g;
}

/* The rays of a group, where they are if that is a pm_ray8, else in `copy`. */
static inline const pm_ray8 *group_rays(const group *g, const void *rays, unsigned n, pm_ray8 *copy) {
  if (n == PM_LANES && (uintptr_t)rays % _Alignof(pm_ray8) == 0)
    return rays;
  memset(copy, 0, sizeof *copy);
  for (unsigned w = 0; w < RAY_WORDS; w++)
    memcpy((char *)copy + 4 * PM_LANES * w, (const char *)rays + 4 * ((size_t)w * n + g->first),
           (size_t)4 * g->count);
  return copy;
}

static inline void intersect_groups(const struct RTCIntersectFunctionNArguments *args, unsigned n) {
  const struct pm_geometry *geometry = args->geometryUserPtr;
  char *rays = (char *)args->rayhit;
  char *hits = rays + (size_t)sizeof(struct RTCRay) * n;
  for (unsigned first = 0; first < n; first += PM_LANES) {
    const group g = group_at(args->valid, n, first);
    if (!g.bits)
      continue;
    pm_ray8 copy;
    const pm_ray8 *eight = group_rays(&g, rays, n, &copy);
    pm_hit at[PM_LANES];
    const uint32_t found = geometry->test.intersect8(geometry->test_user, args->primID, eight, g.bits, at);
    for (unsigned i = 0; i < g.count; i++) {
      if (!(g.bits >> i & 1))
        continue;
      const bool is_hit = (found >> i & 1) && at[i].t > eight->tnear[i] && at[i].t < eight->tfar[i];
      if (is_hit) {
        struct RTCHit hit;
        fill_hit(&hit, &at[i], args->geomID, args->context);
        store_tfar(rays, at[i].t, n, first + i);
        store_words(hits, &hit, HIT_WORDS, n, first + i);
      }
      report(&g.valid[i], is_hit);
    }
  }
}

static inline void occluded_groups(const struct RTCOccludedFunctionNArguments *args, unsigned n) {
  const struct pm_geometry *geometry = args->geometryUserPtr;
  for (unsigned first = 0; first < n; first += PM_LANES) {
    const group g = group_at(args->valid, n, first);
    if (!g.bits)
      continue;
    pm_ray8 copy;
    const pm_ray8 *eight = group_rays(&g, args->ray, n, &copy);
    const uint32_t found = geometry->test.occluded8(geometry->test_user, args->primID, eight, g.bits);
    for (unsigned i = 0; i < g.count; i++) {
      if (!(g.bits >> i & 1))
        continue;
      if (found >> i & 1)
        store_tfar(args->ray, -INFINITY, n, first + i);
      report(&g.valid[i], found >> i & 1);
    }
  }
}

/* A constant N lets the compiler drop the strides for single rays and packets of 8. */
static void on_intersect(const struct RTCIntersectFunctionNArguments *args) {
  const struct pm_geometry *g = args->geometryUserPtr;
  if (args->N == 1)
    intersect_lanes(args, 1);
  else if (!g->test.intersect8 || has_filter(g, args->context))
    intersect_lanes(args, args->N);
  else if (args->N == PM_LANES)
    intersect_groups(args, PM_LANES);
  else
    intersect_groups(args, args->N);
}

static void on_occluded(const struct RTCOccludedFunctionNArguments *args) {
  const struct pm_geometry *g = args->geometryUserPtr;
  if (args->N == 1)
    occluded_lanes(args, 1);
  else if (!g->test.occluded8 || has_filter(g, args->context))
    occluded_lanes(args, args->N);
  else if (args->N == PM_LANES)
    occluded_groups(args, PM_LANES);
  else
    occluded_groups(args, args->N);
}

static void on_bounds(const struct RTCBoundsFunctionArguments *args) {
  const struct pm_geometry *g = args->geometryUserPtr;
  float box[6];
  g->test.bounds(g->test_user, args->primID, args->timeStep, box);
  struct RTCBounds *out = args->bounds_o;
  out->lower_x = box[0], out->lower_y = box[1], out->lower_z = box[2];
  out->upper_x = box[3], out->upper_y = box[4], out->upper_z = box[5];
}

/* Filters ----------------------------------------------------------------------------------------- */

static void unpack_hit(pm_scene_hit *out, float t, const struct RTCHit *hit) {
  out->at.t = t;
  out->at.u = hit->u;
  out->at.v = hit->v;
  out->at.ng[0] = hit->Ng_x;
  out->at.ng[1] = hit->Ng_y;
  out->at.ng[2] = hit->Ng_z;
  out->at.prim = hit->primID;
  out->geom = hit->geomID;
  for (unsigned l = 0; l < PM_INSTANCE_LEVELS; l++)
    out->inst[l] = hit->instID[l];
}

static void on_filter(const struct RTCFilterFunctionNArguments *args) {
  const struct pm_geometry *g = args->geometryUserPtr;
  for (unsigned i = 0; i < args->N; i++) {
    if (args->valid[i] != -1)
      continue;
    pm_ray ray;
    struct RTCHit hit;
    pm_scene_hit candidate;
    load_words(&ray, args->ray, RAY_WORDS, args->N, i);
    load_words(&hit, args->hit, HIT_WORDS, args->N, i);
    unpack_hit(&candidate, ray.tfar, &hit);
    if (!g->filter(g->filter_user, &ray, &candidate))
      args->valid[i] = 0;
  }
}

/* Device ------------------------------------------------------------------------------------------ */

uint32_t pm_version_of_headers(void) { return RTC_VERSION; }

static void on_error(void *user, enum RTCError code, const char *message) {
  const pm_device *device = user;
  device->on_error(device->user, (int)code, message ? message : "");
}

static bool on_memory(void *user, ssize_t bytes, bool post) {
  const pm_device *device = user;
  return device->on_memory(device->user, (int64_t)bytes, post);
}

pm_device *pm_device_new(const char *config, const void *user, pm_error_function error_function,
                         pm_memory_function memory_function, int *error) {
  *error = PM_ERROR_NONE;
  pm_device *device = malloc(sizeof *device);
  if (!device) {
    *error = PM_ERROR_OUT_OF_MEMORY;
    return NULL;
  }
  *device = (pm_device){rtcNewDevice(config), user, error_function, memory_function};
  if (!device->rtc) {
    *error = (int)rtcGetDeviceError(NULL);
    free(device);
    return NULL;
  }
  rtcSetDeviceErrorFunction(device->rtc, on_error, device);
  rtcSetDeviceMemoryMonitorFunction(device->rtc, on_memory, device);
  return device;
}

void pm_device_free(pm_device *device) {
  rtcReleaseDevice(device->rtc);
  free(device);
}

uint32_t pm_device_version(const pm_device *device) {
  return (uint32_t)rtcGetDeviceProperty(device->rtc, RTC_DEVICE_PROPERTY_VERSION);
}

bool pm_device_has_masks(const pm_device *device) {
  return rtcGetDeviceProperty(device->rtc, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED);
}

bool pm_device_has_filters(const pm_device *device) {
  return rtcGetDeviceProperty(device->rtc, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED);
}

/* Geometry ---------------------------------------------------------------------------------------- */

static pm_geometry *new_geometry(const pm_device *device, enum RTCGeometryType type) {
  pm_geometry *g = calloc(1, sizeof *g);
  if (!g) {
    device->on_error(device->user, PM_ERROR_OUT_OF_MEMORY, "no memory for a geometry");
    return NULL;
  }
  g->rtc = rtcNewGeometry(device->rtc, type);
  if (!g->rtc) {
    free(g);
    return NULL;
  }
  rtcSetGeometryUserData(g->rtc, g);
  /* Embree 4's default is bit 0 alone, Embree 3's all bits. */
  rtcSetGeometryMask(g->rtc, 0xffffffffu);
  return g;
}

pm_geometry *pm_geometry_new_user(const pm_device *device, const pm_hit_test *test, const void *user,
                                  uint32_t primitives, uint32_t time_steps) {
  pm_geometry *g = new_geometry(device, RTC_GEOMETRY_TYPE_USER);
  if (!g)
    return NULL;
  pm_geometry_set_test(g, test, user, primitives, time_steps);
  /* The user pointer given here is ignored by Embree: the geometry's is what arrives. */
  rtcSetGeometryBoundsFunction(g->rtc, on_bounds, g);
  rtcSetGeometryIntersectFunction(g->rtc, on_intersect);
  rtcSetGeometryOccludedFunction(g->rtc, on_occluded);
  rtcSetGeometryPointQueryFunction(g->rtc, pm_on_point_query);
  return g;
}

void pm_geometry_set_vertices(pm_geometry *g, const float *vertices, uint32_t vertex_count) {
  rtcSetSharedGeometryBuffer(g->rtc, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices, 0, 12, vertex_count);
}

pm_geometry *pm_geometry_new_triangles(const pm_device *device, const float *vertices, uint32_t vertex_count,
                                       const uint32_t *indices, uint32_t triangle_count) {
  pm_geometry *g = new_geometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  if (!g)
    return NULL;
  pm_geometry_set_vertices(g, vertices, vertex_count);
  rtcSetSharedGeometryBuffer(g->rtc, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices, 0, 12, triangle_count);
  return g;
}

pm_geometry *pm_geometry_new_grids(const pm_device *device, const float *vertices, uint32_t vertex_count,
                                   const pm_grid *grids, uint32_t grid_count) {
  pm_geometry *g = new_geometry(device, RTC_GEOMETRY_TYPE_GRID);
  if (!g)
    return NULL;
  pm_geometry_set_vertices(g, vertices, vertex_count);
  rtcSetSharedGeometryBuffer(g->rtc, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, grids, 0, sizeof *grids, grid_count);
  return g;
}

pm_geometry *pm_geometry_new_instance(const pm_device *device, pm_scene *scene, const float transform[12]) {
  pm_geometry *g = new_geometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  if (!g)
    return NULL;
  g->instanced = scene;
  rtcSetGeometryInstancedScene(g->rtc, (RTCScene)scene);
  rtcSetGeometryTimeStepCount(g->rtc, 1);
  rtcSetGeometryTransform(g->rtc, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform);
  return g;
}

void pm_geometry_free(pm_geometry *g) {
  rtcReleaseGeometry(g->rtc);
  free(g);
}

void pm_geometry_set_test(pm_geometry *g, const pm_hit_test *test, const void *user, uint32_t primitives,
                          uint32_t time_steps) {
  g->test = *test;
  g->test_user = user;
  rtcSetGeometryUserPrimitiveCount(g->rtc, primitives);
  rtcSetGeometryTimeStepCount(g->rtc, time_steps);
}

void pm_geometry_set_mask(pm_geometry *g, uint32_t mask) { rtcSetGeometryMask(g->rtc, mask); }

void pm_geometry_set_filter(pm_geometry *g, pm_filter filter, const void *user) {
  g->filter = filter;
  g->filter_user = user;
  rtcSetGeometryIntersectFilterFunction(g->rtc, on_filter);
  rtcSetGeometryOccludedFilterFunction(g->rtc, on_filter);
}

void pm_geometry_set_quality(pm_geometry *g, int quality) {
  rtcSetGeometryBuildQuality(g->rtc, (enum RTCBuildQuality)quality);
}

void pm_geometry_commit(pm_geometry *g) { rtcCommitGeometry(g->rtc); }

/* Scene ------------------------------------------------------------------------------------------- */

pm_scene *pm_scene_new(const pm_device *device, int quality, int flags) {
  RTCScene scene = rtcNewScene(device->rtc);
  if (!scene)
    return NULL;
  rtcSetSceneBuildQuality(scene, (enum RTCBuildQuality)quality);
  rtcSetSceneFlags(scene, (enum RTCSceneFlags)flags);
  return (pm_scene *)scene;
}

void pm_scene_free(pm_scene *scene) { rtcReleaseScene((RTCScene)scene); }

void pm_scene_attach(pm_scene *scene, pm_geometry *g, uint32_t id) {
  rtcAttachGeometryByID((RTCScene)scene, g->rtc, id);
}

void pm_scene_commit(pm_scene *scene) { rtcCommitScene((RTCScene)scene); }

void pm_scene_bounds(const pm_scene *scene, float out[6]) {
  struct RTCBounds box;
  rtcGetSceneBounds((RTCScene)scene, &box);
  out[0] = box.lower_x, out[1] = box.lower_y, out[2] = box.lower_z;
  out[3] = box.upper_x, out[4] = box.upper_y, out[5] = box.upper_z;
}

/* Rays -------------------------------------------------------------------------------------------- */

bool pm_intersect1(const pm_scene *scene, const pm_ray *ray, pm_scene_hit *hit) {
  struct RTCRayHit query;
  memcpy(&query.ray, ray, sizeof query.ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  for (unsigned l = 0; l < RTC_MAX_INSTANCE_LEVEL_COUNT; l++)
    query.hit.instID[l] = RTC_INVALID_GEOMETRY_ID;
#if PM_EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1((RTCScene)scene, &context, &query);
#else
  rtcIntersect1((RTCScene)scene, &query, NULL);
#endif
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID)
    return false;
  unpack_hit(hit, query.ray.tfar, &query.hit);
  return true;
}

bool pm_occluded1(const pm_scene *scene, const pm_ray *ray) {
  struct RTCRay query;
  memcpy(&query, ray, sizeof query);
#if PM_EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1((RTCScene)scene, &context, &query);
#else
  rtcOccluded1((RTCScene)scene, &query, NULL);
#endif
  return query.tfar == -INFINITY;
}

/* Packets ----------------------------------------------------------------------------------------- */

typedef struct lane_mask {
  _Alignas(32) int valid[PM_LANES];
} lane_mask;

static inline lane_mask mask_of(uint32_t bits) {
  lane_mask mask;
  for (unsigned i = 0; i < PM_LANES; i++)
    mask.valid[i] = bits >> i & 1 ? -1 : 0;
  return mask;
}

uint32_t pm_intersect8(const pm_scene *scene, const pm_ray8 *rays, uint32_t valid, bool coherent,
                       pm_scene_hit hits[PM_LANES]) {
  const lane_mask mask = mask_of(valid);
  struct RTCRayHit8 query;
  memcpy(&query.ray, rays, sizeof query.ray);
  memset(query.hit.geomID, 0xff, sizeof query.hit.geomID); /* PM_INVALID_ID */
  memset(query.hit.instID, 0xff, sizeof query.hit.instID);
#if PM_EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcIntersect8(mask.valid, (RTCScene)scene, &context, &query);
#else
  struct RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcIntersect8(mask.valid, (RTCScene)scene, &query, &arguments);
#endif
  uint32_t found = 0;
  for (unsigned i = 0; i < PM_LANES; i++) {
    if (!(valid >> i & 1) || query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID)
      continue;
    found |= 1u << i;
    struct RTCHit hit;
    load_words(&hit, &query.hit, HIT_WORDS, PM_LANES, i);
    unpack_hit(&hits[i], query.ray.tfar[i], &hit);
  }
  return found;
}

uint32_t pm_occluded8(const pm_scene *scene, const pm_ray8 *rays, uint32_t valid, bool coherent) {
  const lane_mask mask = mask_of(valid);
  struct RTCRay8 query;
  memcpy(&query, rays, sizeof query);
#if PM_EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcOccluded8(mask.valid, (RTCScene)scene, &context, &query);
#else
  struct RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcOccluded8(mask.valid, (RTCScene)scene, &query, &arguments);
#endif
  uint32_t found = 0;
  for (unsigned i = 0; i < PM_LANES; i++)
    found |= (uint32_t)((valid >> i & 1) && query.tfar[i] == -INFINITY) << i;
  return found;
}
