/* Rays: bounds, intervals, masks, filters, packets, instances. */
#include "ball.h"

#include <math.h>

void bounds(void) {
  begin("bounds hold every hit, and rtcGetSceneBounds is tight");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  struct RTCBounds box;
  rtcGetSceneBounds(w.scene, &box);
  EXPECT(box.upper_x > 1 && box.upper_x < 1 + 2 * SCALE && box.lower_z < -1 && box.lower_z > -1 - 2 * SCALE);
  for (int i = 0; i < 1000; i++) {
    struct RTCRayHit q = random_ray();
    intersect1(w.scene, &q, NULL);
    if (!is_hit(&q))
      continue;
    const float x = q.ray.org_x + q.ray.tfar * q.ray.dir_x, z = q.ray.org_z + q.ray.tfar * q.ray.dir_z;
    EXPECT(x >= box.lower_x - 1e-5f && x <= box.upper_x + 1e-5f && z >= box.lower_z - 1e-5f && z <= box.upper_z + 1e-5f);
  }
  free_world(&w);
  end();
}

void interpolation(void) {
  begin("prismarch_interpolate gives the points and normals of hits");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  for (int i = 0; i < 1000; i++) {
    struct RTCRayHit q = random_ray();
    intersect1(w.scene, &q, NULL);
    if (!is_hit(&q))
      continue;
    EXPECT(q.hit.primID < QUADS && q.hit.u >= -1e-5f && q.hit.u <= 1 + 1e-5f && q.hit.v >= -1e-5f && q.hit.v <= 1 + 1e-5f);
    prismarch_point p;
    EXPECT(prismarch_interpolate(w.surface, q.hit.primID, q.hit.u, q.hit.v, 0, &p, NULL) == PRISMARCH_OK);
    const float t = q.ray.tfar;
    EXPECT(fabsf(q.ray.org_x + t * q.ray.dir_x - p.position[0]) < 2e-5f);
    EXPECT(fabsf(q.ray.org_z + t * q.ray.dir_z - p.position[2]) < 2e-5f);
    const float *n = p.geometric_normal;
    const float ng = sqrtf(q.hit.Ng_x * q.hit.Ng_x + q.hit.Ng_y * q.hit.Ng_y + q.hit.Ng_z * q.hit.Ng_z);
    const float along = (n[0] * q.hit.Ng_x + n[1] * q.hit.Ng_y + n[2] * q.hit.Ng_z) / ng;
    EXPECT(fabsf(along) > 0.99f);
    for (int k = 0; k < 1; k++)
      EXPECT(fabsf(n[0] * p.dPdu[0] + n[1] * p.dPdu[1] + n[2] * p.dPdu[2]) < 1e-3f);
  }
  free_world(&w);
  end();
}

void interval(void) {
  begin("tnear and tfar; directions of any length; occluded agrees with intersect");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  for (int i = 0; i < 1000; i++) {
    struct RTCRayHit q = random_ray(), first = q;
    intersect1(w.scene, &first, NULL);
    struct RTCRayHit shadow = q;
    occluded1(w.scene, &shadow.ray, NULL);
    EXPECT((shadow.ray.tfar < 0) == is_hit(&first));
    if (!is_hit(&first))
      continue;
    struct RTCRayHit shorter = q;
    shorter.ray.tfar = 0.999f * first.ray.tfar;
    intersect1(w.scene, &shorter, NULL);
    EXPECT(!is_hit(&shorter));
    struct RTCRayHit behind = q;
    behind.ray.tnear = first.ray.tfar;
    intersect1(w.scene, &behind, NULL);
    EXPECT(!is_hit(&behind) || behind.ray.tfar > first.ray.tfar);
    struct RTCRayHit longer = q;
    longer.ray.dir_x *= 8, longer.ray.dir_y *= 8, longer.ray.dir_z *= 8;
    intersect1(w.scene, &longer, NULL);
    EXPECT(is_hit(&longer) && fabsf(8 * longer.ray.tfar - first.ray.tfar) < 1e-5f * first.ray.tfar + 1e-6f);
  }
  free_world(&w);
  end();
}

void masks(void) {
  begin("ray masks");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  rtcSetGeometryMask(w.geometry, 4);
  rtcCommitGeometry(w.geometry);
  rtcCommitScene(w.scene);
  const float o[3] = {3, 0.1f, 0.1f}, d[3] = {-1, 0, 0};
  for (unsigned mask = 1; mask < 16; mask <<= 1) {
    struct RTCRayHit q = ray_at(o, d), s = q;
    q.ray.mask = s.ray.mask = mask;
    intersect1(w.scene, &q, NULL);
    occluded1(w.scene, &s.ray, NULL);
    EXPECT(is_hit(&q) == (mask == 4) && (s.ray.tfar < 0) == (mask == 4));
  }
  free_world(&w);
  end();
}

/* Rejects all hits but those that leave the ball. */
static int filter_calls;
static void only_leaving(const struct RTCFilterFunctionNArguments *args) {
  if (args->geometryUserPtr == &filter_calls)
    filter_calls++;
  for (unsigned i = 0; i < args->N; i++) {
    if (args->valid[i] != -1)
      continue;
    /* N lanes of words; a ray's direction begins at its fifth word, a hit with its normal. */
    const float *ray = (const float *)args->ray, *hit = (const float *)args->hit;
    float along = 0;
    for (unsigned k = 0; k < 3; k++)
      along += ray[(4 + k) * args->N + i] * hit[k * args->N + i];
    if (along < 0)
      args->valid[i] = 0;
  }
}

void filters(void) {
  begin("filters: a rejected hit lets the ray go on; user data; the call's filter");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  EXPECT(prismarch_geometry_set_user_data(w.geometry, &filter_calls, NULL) == PRISMARCH_OK);
  EXPECT(prismarch_geometry_user_data(w.geometry) == &filter_calls);
  rtcSetGeometryIntersectFilterFunction(w.geometry, only_leaving);
  rtcSetGeometryOccludedFilterFunction(w.geometry, only_leaving);
  rtcCommitGeometry(w.geometry);
  rtcCommitScene(w.scene);
  filter_calls = 0;
  const float o[3] = {3, 0.1f, 0.2f}, d[3] = {-1, 0, 0};
  struct RTCRayHit q = ray_at(o, d), s = q;
  intersect1(w.scene, &q, NULL);
  EXPECT(is_hit(&q) && filter_calls > 1 && q.hit.Ng_x < 0);
  occluded1(w.scene, &s.ray, NULL);
  EXPECT(s.ray.tfar < 0);
  /* Half way in only the far side is left, and a ray that ends before it is not occluded. */
  struct RTCRayHit half = ray_at(o, d);
  half.ray.tfar = 3;
  occluded1(w.scene, &half.ray, NULL);
  EXPECT(half.ray.tfar > 0);
#if EMBREE_MAJOR == 3 /* Embree 4 does not give the call's filter to user geometries. */
  rtcSetGeometryIntersectFilterFunction(w.geometry, NULL);
  rtcSetGeometryOccludedFilterFunction(w.geometry, NULL);
  rtcCommitGeometry(w.geometry);
  rtcCommitScene(w.scene);
  struct RTCRayHit p = ray_at(o, d);
  intersect1(w.scene, &p, only_leaving);
  EXPECT(is_hit(&p) && p.hit.primID == q.hit.primID && p.ray.tfar == q.ray.tfar);
#endif
  free_world(&w);
  end();
}

#if EMBREE_MAJOR == 3
#define PACKET(N, valid, scene, query)                                                                                \
  do {                                                                                                                \
    struct RTCIntersectContext context;                                                                               \
    rtcInitIntersectContext(&context);                                                                                \
    rtcIntersect##N(valid, scene, &context, query);                                                                   \
  } while (0)
#else
#define PACKET(N, valid, scene, query) rtcIntersect##N(valid, scene, query, NULL)
#endif

/* A ray from the same point that goes nearly the same way. */
static struct RTCRayHit ray_beside(const struct RTCRayHit *first) {
  struct RTCRayHit q = *first;
  q.ray.dir_x += 0.01f * (uniform() - 0.5f);
  q.ray.dir_y += 0.01f * (uniform() - 0.5f);
  q.ray.dir_z += 0.01f * (uniform() - 0.5f);
  return q;
}

#define PACKET_CASE(N)                                                                                                \
  void packets##N(void) {                                                                                             \
    begin("packets of " #N ": lanes as single rays, inactive ones untouched");                                        \
    world w = new_world(RTC_SCENE_FLAG_NONE);                                                                         \
    for (int round = 0; round < 200; round++) {                                                                       \
      struct RTCRayHit single[N];                                                                                     \
      struct RTCRayHit##N all;                                                                                        \
      memset(&all, 0, sizeof all);                                                                                    \
      int valid[N] __attribute__((aligned(64)));                                                                      \
      for (unsigned i = 0; i < N; i++) {                                                                              \
        /* Every other packet goes one way. */                                                                        \
        single[i] = i && round % 2 ? ray_beside(&single[0]) : random_ray();                                           \
        valid[i] = uniform() < 0.3f ? 0 : -1;                                                                         \
        const struct RTCRay *r = &single[i].ray;                                                                      \
        all.ray.org_x[i] = r->org_x, all.ray.org_y[i] = r->org_y, all.ray.org_z[i] = r->org_z;                        \
        all.ray.dir_x[i] = r->dir_x, all.ray.dir_y[i] = r->dir_y, all.ray.dir_z[i] = r->dir_z;                        \
        all.ray.tfar[i] = r->tfar, all.ray.mask[i] = r->mask;                                                         \
        all.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;                                                                  \
      }                                                                                                               \
      PACKET(N, valid, w.scene, &all);                                                                                \
      for (unsigned i = 0; i < N; i++) {                                                                              \
        if (valid[i] == -1)                                                                                           \
          intersect1(w.scene, &single[i], NULL);                                                                      \
        EXPECT(all.hit.geomID[i] == single[i].hit.geomID);                                                            \
        EXPECT(fabsf(all.ray.tfar[i] - single[i].ray.tfar) <= 2e-7f * single[i].ray.tfar);                            \
        EXPECT(!is_hit(&single[i]) || (all.hit.primID[i] == single[i].hit.primID &&                                   \
                                       fabsf(all.hit.u[i] - single[i].hit.u) <= 1e-6f));                              \
      }                                                                                                               \
    }                                                                                                                 \
    free_world(&w);                                                                                                   \
    end();                                                                                                            \
  }
PACKET_CASE(4)
PACKET_CASE(8)
PACKET_CASE(16)

/* Bits of lanes that are occluded; `hits` has the packet's hits. */
static unsigned trace8(RTCScene scene, const struct RTCRayHit rays[8], struct RTCRayHit8 *hits) {
  int valid[8] __attribute__((aligned(64)));
  struct RTCRay8 shadows;
  memset(hits, 0, sizeof *hits);
  for (unsigned i = 0; i < 8; i++) {
    const struct RTCRay *r = &rays[i].ray;
    hits->ray.org_x[i] = r->org_x, hits->ray.org_y[i] = r->org_y, hits->ray.org_z[i] = r->org_z;
    hits->ray.dir_x[i] = r->dir_x, hits->ray.dir_y[i] = r->dir_y, hits->ray.dir_z[i] = r->dir_z;
    hits->ray.tfar[i] = r->tfar, hits->ray.mask[i] = r->mask;
    hits->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    valid[i] = -1;
  }
  shadows = hits->ray;
  PACKET(8, valid, scene, hits);
#if EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded8(valid, scene, &context, &shadows);
#else
  rtcOccluded8(valid, scene, &shadows, NULL);
#endif
  unsigned bits = 0;
  for (unsigned i = 0; i < 8; i++)
    bits |= (unsigned)(shadows.tfar[i] < 0) << i;
  return bits;
}

void unfiltered(void) {
  begin("has_filter = false: the same hits, alone and in packets; filters are not asked");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  const ball b = new_ball(1);
  prismarch_surface_desc d = desc_of(&b, w.map);
  d.has_filter = false;
  prismarch_surface *surface = surface_of(&d);
  RTCGeometry geometry = geometry_of(w.device, surface);
  rtcSetGeometryIntersectFilterFunction(geometry, only_leaving);
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(w.device);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  for (int round = 0; round < 300; round++) {
    struct RTCRayHit rays[8];
    for (unsigned i = 0; i < 8; i++)
      rays[i] = i && round % 2 ? ray_beside(&rays[0]) : random_ray();
    struct RTCRayHit8 filtered, free;
    const unsigned dark[2] = {trace8(w.scene, rays, &filtered), trace8(scene, rays, &free)};
    EXPECT(dark[0] == dark[1]);
    for (unsigned i = 0; i < 8; i++) {
      struct RTCRayHit one = rays[i], other = rays[i];
      intersect1(w.scene, &one, NULL);
      intersect1(scene, &other, NULL);
      EXPECT(one.ray.tfar == other.ray.tfar && one.hit.primID == other.hit.primID && one.hit.u == other.hit.u);
      EXPECT(free.hit.geomID[i] == one.hit.geomID && (dark[0] >> i & 1) == (unsigned)is_hit(&one));
      EXPECT(fabsf(free.ray.tfar[i] - one.ray.tfar) <= 2e-7f * one.ray.tfar);
      EXPECT(!is_hit(&one) || (free.hit.primID[i] == one.hit.primID && fabsf(free.hit.u[i] - one.hit.u) <= 1e-6f));
    }
  }
  rtcReleaseScene(scene);
  prismarch_surface_release(surface);
  free_world(&w);
  end();
}

#if EMBREE_MAJOR == 3 /* Embree 4 has no streams. */
enum { LONGEST = 37 };

/* A stream of which every word has an array of its own. */
typedef struct arrays {
  float org[3][LONGEST], dir[3][LONGEST], tnear[LONGEST], tfar[LONGEST], time[LONGEST], ng[3][LONGEST], uv[2][LONGEST];
  unsigned mask[LONGEST], id[LONGEST], flags[LONGEST], prim[LONGEST], geom[LONGEST], inst[LONGEST];
} arrays;

void pointers(void) {
  begin("rtcIntersectNp, rtcOccludedNp: rays in arrays, any number");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (unsigned n = 1; n <= LONGEST; n += 9) {
    arrays a;
    memset(&a, 0, sizeof a);
    struct RTCRayHit single[LONGEST];
    for (unsigned i = 0; i < n; i++) {
      single[i] = random_ray();
      const struct RTCRay *r = &single[i].ray;
      a.org[0][i] = r->org_x, a.org[1][i] = r->org_y, a.org[2][i] = r->org_z;
      a.dir[0][i] = r->dir_x, a.dir[1][i] = r->dir_y, a.dir[2][i] = r->dir_z;
      a.tfar[i] = r->tfar, a.mask[i] = r->mask, a.geom[i] = RTC_INVALID_GEOMETRY_ID;
    }
    struct RTCRayHitNp all = {
        {a.org[0], a.org[1], a.org[2], a.tnear, a.dir[0], a.dir[1], a.dir[2], a.time, a.tfar, a.mask, a.id, a.flags},
        {a.ng[0], a.ng[1], a.ng[2], a.uv[0], a.uv[1], a.prim, a.geom, {a.inst}}};
    rtcIntersectNp(w.scene, &context, &all, n);
    for (unsigned i = 0; i < n; i++) {
      const float far = single[i].ray.tfar;
      intersect1(w.scene, &single[i], NULL);
      EXPECT(a.geom[i] == single[i].hit.geomID && a.tfar[i] == single[i].ray.tfar);
      a.tfar[i] = far;
    }
    rtcOccludedNp(w.scene, &context, &all.ray, n);
    for (unsigned i = 0; i < n; i++)
      EXPECT((a.tfar[i] < 0) == is_hit(&single[i]));
  }
  free_world(&w);
  end();
}
#endif

void instances(void) {
  begin("instances, and the instance stack");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  RTCScene top = rtcNewScene(w.device);
  for (unsigned id = 0; id < 3; id++) {
    RTCGeometry instance = instance_of(w.device, w.scene, 4 * (float)id);
    rtcAttachGeometryByID(top, instance, 10 + id);
    rtcReleaseGeometry(instance);
  }
  rtcCommitScene(top);
  for (unsigned id = 0; id < 3; id++) {
    const float o[3] = {4 * (float)id, 0.1f, 3}, d[3] = {0, 0, -1};
    struct RTCRayHit q = ray_at(o, d);
    intersect1(top, &q, NULL);
    const float o0[3] = {0, 0.1f, 3};
    struct RTCRayHit alone = ray_at(o0, d);
    intersect1(w.scene, &alone, NULL);
    EXPECT(is_hit(&q) && q.hit.instID[0] == 10 + id && q.hit.geomID == 0 && q.hit.primID == alone.hit.primID);
    EXPECT(fabsf(q.ray.tfar - alone.ray.tfar) < 1e-5f);
  }
#if RTC_MAX_INSTANCE_LEVEL_COUNT > 1
  RTCScene higher = rtcNewScene(w.device);
  RTCGeometry instance = instance_of(w.device, top, 0);
  rtcAttachGeometryByID(higher, instance, 7);
  rtcReleaseGeometry(instance);
  rtcCommitScene(higher);
  const float o[3] = {4, 0.1f, 3}, d[3] = {0, 0, -1};
  struct RTCRayHit q = ray_at(o, d);
  intersect1(higher, &q, NULL);
  EXPECT(is_hit(&q) && q.hit.instID[0] == 7 && q.hit.instID[1] == 11);
  rtcReleaseScene(higher);
#endif
  rtcReleaseScene(top);
  free_world(&w);
  end();
}

void odd_rays(void) {
  begin("rays from far away, of huge and tiny directions, of none, of NaN: no false hit, no fault");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  const float bad[] = {1e15f, -1e15f, 1e-30f, 0, NAN, INFINITY, -INFINITY};
  /* Debian's Embree 3 stops the program itself where a ray is NaN or infinite. */
  const int count = EMBREE_MAJOR == 3 ? 4 : 7;
  for (int i = 0; i < count; i++)
    for (int k = 0; k < 2; k++) {
      float o[3] = {3, 0.1f, 0.1f}, d[3] = {-1, 0, 0};
      if (k == 0)
        o[1] = bad[i];
      else
        d[0] = bad[i];
      struct RTCRayHit q = ray_at(o, d);
      intersect1(w.scene, &q, NULL);
      EXPECT((i == 2 || i == 3) && k == 0 ? is_hit(&q) : (k == 1 && i < 4) || !is_hit(&q));
      EXPECT(!is_hit(&q) || (q.ray.tfar > 0 && q.ray.tfar < 1e31f));
    }
  EXPECT(prismarch_surface_check(w.surface, NULL) == PRISMARCH_OK);
  free_world(&w);
  end();
}

void watertight(void) {
  begin("rays from inside a closed ball do not get out (20 000)");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  int out = 0;
  for (int i = 0; i < 20000; i++) {
    const float o[3] = {0.2f * uniform(), 0.2f * uniform(), 0.2f * uniform()};
    const float d[3] = {uniform() - 0.5f, uniform() - 0.5f, uniform() - 0.5f};
    struct RTCRayHit q = ray_at(o, d);
    intersect1(w.scene, &q, NULL);
    out += !is_hit(&q);
  }
  EXPECT(out == 0);
  free_world(&w);
  end();
}
