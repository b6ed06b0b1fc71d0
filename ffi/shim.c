/* Devices, geometries, scenes and rays: what differs between Embree 3 and 4 differs here. */
#include "lanes.h"

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
  pm_set_callbacks(g->rtc);
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
  rtcSetGeometryIntersectFilterFunction(g->rtc, pm_on_filter);
  rtcSetGeometryOccludedFilterFunction(g->rtc, pm_on_filter);
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
