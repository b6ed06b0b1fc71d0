/* Embree 3 and 4 under one set of names. */
#ifndef EXAMPLES_EMBREE_H
#define EXAMPLES_EMBREE_H

#if EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif
#include <prismarch.h>

#include <string.h>

/* A filter of the call, or NULL. */
static inline void intersect1(RTCScene scene, struct RTCRayHit *query, RTCFilterFunctionN filter) {
#if EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.filter = filter;
  rtcIntersect1(scene, &context, query);
#else
  struct RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.filter = filter;
  if (filter)
    arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  rtcIntersect1(scene, query, &arguments);
#endif
}

static inline void occluded1(RTCScene scene, struct RTCRay *ray, RTCFilterFunctionN filter) {
#if EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.filter = filter;
  rtcOccluded1(scene, &context, ray);
#else
  struct RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.filter = filter;
  if (filter)
    arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  rtcOccluded1(scene, ray, &arguments);
#endif
}

static inline struct RTCRayHit ray_at(const float origin[3], const float direction[3]) {
  struct RTCRayHit query;
  memset(&query, 0, sizeof query);
  query.ray.org_x = origin[0], query.ray.org_y = origin[1], query.ray.org_z = origin[2];
  query.ray.dir_x = direction[0], query.ray.dir_y = direction[1], query.ray.dir_z = direction[2];
  query.ray.tfar = 1e30f;
  query.ray.mask = 0xffffffffu;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.primID = RTC_INVALID_GEOMETRY_ID;
  for (unsigned l = 0; l < RTC_MAX_INSTANCE_LEVEL_COUNT; l++)
    query.hit.instID[l] = RTC_INVALID_GEOMETRY_ID;
  return query;
}

#endif
