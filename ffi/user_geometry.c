/* User geometry: Embree's callbacks, for any number of lanes, and the filters of its hits. */
#include "lanes.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* Embree 4 wants to be told which lanes hit; Embree 3 looks at tfar alone. */
static inline void report(int *valid, bool hit) {
#if PM_EMBREE_MAJOR >= 4
  *valid = hit ? -1 : 0;
#else
  (void)valid;
  (void)hit;
#endif
}

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

/* Without a filter, whether a ray is occluded needs no hit, and the first hit of a primitive is final. What filters a
 * caller has set for a geometry cannot be seen from here. */
static inline bool has_filter(const struct pm_geometry *g, const query_context *context) {
#if PM_EMBREE_MAJOR == 3
  return g->filter || g->may_be_filtered || context->filter;
#else
  (void)context;
  return g->filter || g->may_be_filtered;
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
  invoke_filter invoke; /* NULL: there is no filter */
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
    if (!q->invoke)
      return true;
    int valid = -1;
    struct RTCFilterFunctionNArguments candidate = {
        .valid = &valid,
        .geometryUserPtr = q->geometry->is_foreign
                               ? atomic_load_explicit(&q->geometry->caller_data, memory_order_relaxed)
                               : (void *)q->geometry,
        .context = q->context,
        .ray = (struct RTCRayN *)ray,
        .hit = (struct RTCHitN *)hit,
        .N = 1,
    };
    const pm_hit_test *test = &q->geometry->test;
    const uint32_t begun = test->begin_filter ? test->begin_filter(q->geometry->test_user) : 0;
    q->invoke(q->args, &candidate);
    if (test->end_filter)
      test->end_filter(q->geometry->test_user, begun);
    if (valid == -1)
      return true;
    ray->tnear = at.t;
    ray->tfar = limit;
  }
  return false;
}

static inline void intersect_lanes(const struct RTCIntersectFunctionNArguments *args, unsigned n) {
  const struct pm_geometry *g = args->geometryUserPtr;
  const query q = {g,
                   args,
                   args->context,
                   has_filter(g, args->context) ? invoke_intersect_filter : NULL,
                   args->primID,
                   args->geomID};
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
  const struct pm_geometry *g = args->geometryUserPtr;
  const query q = {g,
                   args,
                   args->context,
                   has_filter(g, args->context) ? invoke_occluded_filter : NULL,
                   args->primID,
                   args->geomID};
  for (unsigned i = 0; i < n; i++) {
    if (args->valid[i] != -1)
      continue;
    pm_ray ray;
    struct RTCHit hit;
    load_words(&ray, args->ray, RAY_WORDS, n, i);
    const bool found = q.invoke ? first_accepted(&q, &ray, &hit) : g->test.occluded(g->test_user, q.prim, &ray);
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

/* One ray whose hits nothing filters: where it lies. */
static inline void intersect_alone(const struct RTCIntersectFunctionNArguments *args) {
  const struct pm_geometry *g = args->geometryUserPtr;
  struct RTCRayHit *ray = (struct RTCRayHit *)args->rayhit;
  pm_hit at;
  const bool found = g->test.intersect(g->test_user, args->primID, (const pm_ray *)&ray->ray, &at) &&
                     at.t > ray->ray.tnear && at.t < ray->ray.tfar;
  if (found) {
    ray->ray.tfar = at.t;
    fill_hit(&ray->hit, &at, args->geomID, args->context);
  }
  report(args->valid, found);
}

/* A constant N lets the compiler drop the strides for single rays and packets of 8. */
static void on_intersect(const struct RTCIntersectFunctionNArguments *args) {
  const struct pm_geometry *g = args->geometryUserPtr;
  const bool is_filtered = has_filter(g, args->context);
  if (args->N == 1 && !is_filtered && args->valid[0] == -1)
    intersect_alone(args);
  else if (args->N == 1)
    intersect_lanes(args, 1);
  else if (!g->test.intersect8 || is_filtered)
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

void pm_on_filter(const struct RTCFilterFunctionNArguments *args) {
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

void pm_set_callbacks(RTCGeometry geometry) {
  /* The user pointer given here is ignored by Embree: the geometry's is what arrives. */
  rtcSetGeometryBoundsFunction(geometry, on_bounds, NULL);
  rtcSetGeometryIntersectFunction(geometry, on_intersect);
  rtcSetGeometryOccludedFunction(geometry, on_occluded);
  rtcSetGeometryPointQueryFunction(geometry, pm_on_point_query);
}
