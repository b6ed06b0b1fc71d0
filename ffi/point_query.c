/* Nearest points: rtcPointQuery over user geometries. */
#include "embree.h"

#include <math.h>
#include <string.h>

typedef struct search {
  RTCScene scene;
  bool is_foreign; /* instances in the scene are not ours */
  bool any;
  pm_closest best;
} search;

/* The search that this thread is in: Embree calls back on the thread that asks, and tells a callback neither the geometry nor
 * the scene. NULL in searches of a caller's own. */
static _Thread_local search *present;

/* The geometry of a callback: Embree names it by numbers alone. */
static const struct pm_geometry *geometry_of(const search *s, const struct RTCPointQueryFunctionArguments *args) {
  RTCScene scene = s->scene;
  for (unsigned l = 0; l < args->context->instStackSize; l++) {
    const struct pm_geometry *instance = rtcGetGeometryUserData(rtcGetGeometry(scene, args->context->instID[l]));
    scene = (RTCScene)instance->instanced;
  }
  return rtcGetGeometryUserData(rtcGetGeometry(scene, args->geomID));
}

/* Point and radius stay those of the world, also under instances: a transform that stretches has no one factor for distances. */
bool pm_on_point_query(struct RTCPointQueryFunctionArguments *args) {
  search *s = present;
  if (!s || (s->is_foreign && args->context->instStackSize))
    return false;
  const struct pm_geometry *g = geometry_of(s, args);
  if (!g->test.closest)
    return false;
  const unsigned depth = args->context->instStackSize;
  pm_point_query query = {{args->query->x, args->query->y, args->query->z},
                          args->query->radius,
                          args->query->time,
                          {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}};
  if (depth)
    for (unsigned column = 0; column < 4; column++)
      memcpy(&query.to_world[3 * column], &args->context->inst2world[depth - 1][4 * column], 3 * sizeof(float));
  pm_closest found;
  if (!g->test.closest(g->test_user, args->primID, &query, &found) || !(found.distance <= args->query->radius))
    return false;
  found.geom = args->geomID;
  for (unsigned l = 0; l < PM_INSTANCE_LEVELS; l++)
    found.inst[l] = l < depth ? args->context->instID[l] : PM_INVALID_ID;
  s->any = true;
  s->best = found;
  args->query->radius = found.distance;
  return true;
}

static bool closest(search *s, const float point[3], float radius, float time, pm_closest *found) {
  struct RTCPointQuery query = {point[0], point[1], point[2], time, radius};
  struct RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  /* A hit test may ask, too. */
  search *outer = present;
  present = s;
  rtcPointQuery(s->scene, &query, &context, NULL, NULL);
  present = outer;
  if (s->any)
    *found = s->best;
  return s->any;
}

bool pm_closest1(const pm_scene *scene, const float point[3], float radius, float time, pm_closest *found) {
  return closest(&(search){.scene = (RTCScene)scene}, point, radius, time, found);
}

bool pm_closest_in(void *scene, const float point[3], float radius, float time, pm_closest *found) {
  return closest(&(search){.scene = scene, .is_foreign = true}, point, radius, time, found);
}

bool pm_foreign_is_committed(void *scene) {
  struct RTCBounds box;
  box.lower_x = NAN;
  /* Of a scene that was not committed, or changed since, Embree says nothing but an error. */
  rtcGetSceneBounds(scene, &box);
  return !isnan(box.lower_x);
}
