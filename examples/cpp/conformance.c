/* Whether a surface behaves as Embree's own geometries do: one line per case, exit code 1 where one fails. */
#define _POSIX_C_SOURCE 200809L
#include "embree.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static int failures;
static const char *case_name;
static int case_failed;

static void begin(const char *name) {
  case_name = name;
  case_failed = 0;
}

static void expect(int holds, const char *what) {
  if (holds || case_failed)
    return;
  case_failed = 1;
  failures++;
  printf("FAIL %s: %s\n", case_name, what);
}

static void end(void) {
  if (!case_failed)
    printf("ok   %s\n", case_name);
}

#define EXPECT(what) expect((what) ? 1 : 0, #what)

static unsigned long long seed = 1;
static float uniform(void) {
  seed = seed * 6364136223846793005ull + 1442695040888963407ull;
  return (float)(seed >> 40) / 16777216.0f;
}

/* A sphere of radius 1 of RING x BELTS quads, displaced by 0 to 0.1 of noise. */
enum { RING = 16, BELTS = 8, VERTICES = (RING + 1) * (BELTS + 1), QUADS = RING * BELTS, SIDE = 64 };
static const float SCALE = 0.1f;

typedef struct ball {
  float positions[VERTICES][3], normals[VERTICES][3], texcoords[VERTICES][2];
  uint32_t quads[QUADS][4];
} ball;

static ball new_ball(float radius) {
  static const float pi = 3.14159265f;
  ball b;
  for (int j = 0; j <= BELTS; j++)
    for (int i = 0; i <= RING; i++) {
      const int v = j * (RING + 1) + i;
      const float a = 2 * pi * (float)(i % RING) / RING, c = pi * ((float)j / BELTS - 0.5f);
      /* The poles are one point each, to the bit. */
      const float r = j % BELTS ? cosf(c) : 0;
      const float n[3] = {r * cosf(a), r * sinf(a), j % BELTS ? sinf(c) : (j ? 1.0f : -1.0f)};
      for (int k = 0; k < 3; k++) {
        b.normals[v][k] = n[k];
        b.positions[v][k] = radius * n[k];
      }
      b.texcoords[v][0] = (float)i / RING;
      b.texcoords[v][1] = (float)j / BELTS;
    }
  for (int j = 0; j < BELTS; j++)
    for (int i = 0; i < RING; i++) {
      const uint32_t v = (uint32_t)(j * (RING + 1) + i);
      const uint32_t quad[4] = {v, v + 1, v + RING + 2, v + RING + 1};
      memcpy(b.quads[j * RING + i], quad, sizeof quad);
    }
  return b;
}

/* Noise, but none on the belts at the poles: their edges have other texture coordinates on either side, and must not open. */
static void noise(uint16_t texels[SIDE * SIDE]) {
  enum { BELT = SIDE / BELTS + 1 };
  for (int i = 0; i < SIDE * SIDE; i++)
    texels[i] = i < SIDE * BELT || i >= SIDE * (SIDE - BELT) ? 0 : (uint16_t)(65535 * uniform());
}

static prismarch_map *new_map(void) {
  uint16_t texels[SIDE * SIDE];
  noise(texels);
  const prismarch_texels t = {texels, PRISMARCH_TEXEL_U16, 0, 0};
  prismarch_map *map = NULL;
  prismarch_error error;
  if (prismarch_map_create(SIDE, SIDE, &t, PRISMARCH_WRAP_REPEAT, &map, &error))
    printf("FAIL map: %s\n", error.message), exit(1);
  return map;
}

static prismarch_surface_desc desc_of(const ball *b, prismarch_map *map) {
  prismarch_surface_desc d;
  prismarch_surface_desc_init(&d);
  d.vertex_count = VERTICES;
  d.primitive_count = QUADS;
  d.primitive = PRISMARCH_QUADS;
  d.indices.data = b->quads;
  d.vertices.positions.data = b->positions;
  d.vertices.normals.data = b->normals;
  d.texcoords.data = b->texcoords;
  d.map = map;
  d.scale = SCALE;
  return d;
}

static prismarch_surface *surface_of(const prismarch_surface_desc *desc) {
  prismarch_surface *surface = NULL;
  prismarch_error error;
  if (prismarch_surface_create(desc, &surface, &error))
    printf("FAIL surface: %s\n", error.message), exit(1);
  return surface;
}

static RTCGeometry geometry_of(RTCDevice device, prismarch_surface *surface) {
  RTCGeometry geometry = NULL;
  prismarch_error error;
  if (prismarch_geometry_create(device, surface, &geometry, &error))
    printf("FAIL geometry: %s\n", error.message), exit(1);
  rtcSetGeometryMask(geometry, 0xffffffffu);
  return geometry;
}

/* A device with one ball in one scene. */
typedef struct world {
  RTCDevice device;
  RTCScene scene;
  RTCGeometry geometry;
  prismarch_surface *surface;
  prismarch_map *map;
} world;

static world new_world(enum RTCSceneFlags flags) {
  world w;
  const ball b = new_ball(1);
  w.device = rtcNewDevice(NULL);
  w.map = new_map();
  const prismarch_surface_desc d = desc_of(&b, w.map);
  w.surface = surface_of(&d);
  w.geometry = geometry_of(w.device, w.surface);
  rtcCommitGeometry(w.geometry);
  w.scene = rtcNewScene(w.device);
  rtcSetSceneFlags(w.scene, flags);
  rtcAttachGeometry(w.scene, w.geometry);
  rtcCommitScene(w.scene);
  return w;
}

static void free_world(world *w) {
  rtcReleaseGeometry(w->geometry);
  rtcReleaseScene(w->scene);
  prismarch_surface_release(w->surface);
  prismarch_map_release(w->map);
  rtcReleaseDevice(w->device);
}

static struct RTCRayHit random_ray(void) {
  float o[3], d[3];
  for (int k = 0; k < 3; k++) {
    o[k] = 4 * uniform() - 2;
    d[k] = (uniform() - 0.5f) - 0.5f * o[k];
  }
  return ray_at(o, d);
}

static int is_hit(const struct RTCRayHit *q) { return q->hit.geomID != RTC_INVALID_GEOMETRY_ID; }

static void bounds(void) {
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

static void interpolation(void) {
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

static void interval(void) {
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

static void masks(void) {
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

static void filters(void) {
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

#define PACKET_CASE(N)                                                                                                \
  static void packets##N(void) {                                                                                      \
    begin("packets of " #N ": lanes as single rays, inactive ones untouched");                                        \
    world w = new_world(RTC_SCENE_FLAG_NONE);                                                                         \
    for (int round = 0; round < 100; round++) {                                                                       \
      struct RTCRayHit single[N];                                                                                     \
      struct RTCRayHit##N all;                                                                                        \
      memset(&all, 0, sizeof all);                                                                                    \
      int valid[N] __attribute__((aligned(64)));                                                                      \
      for (unsigned i = 0; i < N; i++) {                                                                              \
        single[i] = random_ray();                                                                                     \
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
        EXPECT(all.hit.geomID[i] == single[i].hit.geomID && all.ray.tfar[i] == single[i].ray.tfar);                   \
        EXPECT(!is_hit(&single[i]) ||                                                                                 \
               (all.hit.primID[i] == single[i].hit.primID && all.hit.u[i] == single[i].hit.u));                       \
      }                                                                                                               \
    }                                                                                                                 \
    free_world(&w);                                                                                                   \
    end();                                                                                                            \
  }
PACKET_CASE(4)
PACKET_CASE(8)
PACKET_CASE(16)

static RTCGeometry instance_of(RTCDevice device, RTCScene scene, float x) {
  const float transform[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, x, 0, 0};
  RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, scene);
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform);
  rtcSetGeometryMask(instance, 0xffffffffu);
  rtcCommitGeometry(instance);
  return instance;
}

static void instances(void) {
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

static void odd_rays(void) {
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

static void watertight(void) {
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

static void edits(void) {
  begin("edits of the map and of vertices, with refit and in dynamic scenes");
  for (int dynamic = 0; dynamic < 2; dynamic++) {
    world w = new_world(dynamic ? RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_NONE);
    rtcSetGeometryBuildQuality(w.geometry, dynamic ? RTC_BUILD_QUALITY_REFIT : RTC_BUILD_QUALITY_MEDIUM);
    const float o[3] = {3, 0.1f, 0.1f}, d[3] = {-1, 0, 0};
    static uint16_t flat[SIDE * SIDE];
    prismarch_texels t = {flat, PRISMARCH_TEXEL_U16, 0, 0};
    bool needed = true;
    EXPECT(prismarch_map_update(w.map, 0, 0, SIDE, SIDE, &t, &needed, NULL) == PRISMARCH_OK);
    if (needed) {
      rtcCommitGeometry(w.geometry);
      rtcCommitScene(w.scene);
    }
    EXPECT(prismarch_map_update(w.map, 3, 4, 10, 10, &t, &needed, NULL) == PRISMARCH_OK && !needed);
    struct RTCRayHit low = ray_at(o, d);
    intersect1(w.scene, &low, NULL);
    EXPECT(is_hit(&low) && low.ray.tfar > 2);
    for (int i = 0; i < SIDE * SIDE; i++)
      flat[i] = 65535;
    EXPECT(prismarch_map_update(w.map, 0, 0, SIDE, SIDE, &t, &needed, NULL) == PRISMARCH_OK);
    if (needed) {
      rtcCommitGeometry(w.geometry);
      rtcCommitScene(w.scene);
    }
    struct RTCRayHit high = ray_at(o, d);
    intersect1(w.scene, &high, NULL);
    EXPECT(is_hit(&high) && fabsf(low.ray.tfar - high.ray.tfar - SCALE) < 0.01f);
    const ball bigger = new_ball(1.5f);
    prismarch_vertices v;
    memset(&v, 0, sizeof v);
    v.positions.data = bigger.positions;
    v.normals.data = bigger.normals;
    EXPECT(prismarch_surface_update_vertices(w.surface, 0, &v, &needed, NULL) == PRISMARCH_OK && needed);
    rtcCommitGeometry(w.geometry);
    rtcCommitScene(w.scene);
    struct RTCRayHit big = ray_at(o, d);
    intersect1(w.scene, &big, NULL);
    EXPECT(is_hit(&big) && fabsf(high.ray.tfar - big.ray.tfar - 0.5f) < 0.05f);
    memset(flat, 0, sizeof flat);
    free_world(&w);
  }
  end();
}

static void motion(void) {
  begin("motion blur: the surface moves between its time steps");
  const ball small = new_ball(1), large = new_ball(2);
  prismarch_map *map = new_map();
  prismarch_surface_desc d = desc_of(&small, map);
  prismarch_vertices later;
  memset(&later, 0, sizeof later);
  later.positions.data = large.positions;
  later.normals.data = large.normals;
  d.time_step_count = 2;
  d.later_steps = &later;
  prismarch_surface *surface = surface_of(&d);
  RTCDevice device = rtcNewDevice(NULL);
  RTCGeometry geometry = geometry_of(device, surface);
  rtcCommitGeometry(geometry);
  RTCScene scene = rtcNewScene(device);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  float t[3];
  for (int k = 0; k < 3; k++) {
    const float o[3] = {4, 0.1f, 0.1f}, dir[3] = {-1, 0, 0};
    struct RTCRayHit q = ray_at(o, dir);
    q.ray.time = 0.5f * (float)k;
    intersect1(scene, &q, NULL);
    EXPECT(is_hit(&q));
    t[k] = q.ray.tfar;
  }
  EXPECT(fabsf(t[0] - t[1] - 0.5f) < 0.06f && fabsf(t[1] - t[2] - 0.5f) < 0.06f);
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  prismarch_surface_release(surface);
  prismarch_map_release(map);
  end();
}

static void closest(void) {
  begin("prismarch_closest");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  bool found = false;
  prismarch_closest_point p;
  const float position[3] = {3, 0, 0};
  EXPECT(prismarch_closest(w.scene, position, 10, 0, &found, &p, NULL) == PRISMARCH_OK && found);
  EXPECT(p.distance > 1.85f && p.distance < 2.1f && p.geom_id == 0 && p.prim_id < QUADS);
  prismarch_point at;
  EXPECT(prismarch_interpolate(w.surface, p.prim_id, p.u, p.v, 0, &at, NULL) == PRISMARCH_OK);
  for (int k = 0; k < 3; k++)
    EXPECT(fabsf(at.position[k] - p.position[k]) < 1e-4f);
  EXPECT(prismarch_closest(w.scene, position, 1, 0, &found, &p, NULL) == PRISMARCH_OK && !found);
  free_world(&w);
  end();
}

typedef struct nearest {
  const prismarch_surface *surface;
  int calls;
  bool found;
  unsigned instances;
  prismarch_closest_point point;
} nearest;

static bool is_nearer(struct RTCPointQueryFunctionArguments *args) {
  nearest *n = args->userPtr;
  n->calls++;
  const unsigned depth = args->context->instStackSize;
  const float position[3] = {args->query->x, args->query->y, args->query->z};
  bool found = false;
  prismarch_closest_point point;
  const prismarch_status status =
      prismarch_surface_closest(n->surface, args->primID, position, args->query->radius, args->query->time,
                                depth ? args->context->inst2world[depth - 1] : NULL, &found, &point, NULL);
  if (status != PRISMARCH_OK || !found)
    return false;
  n->found = true, n->instances = depth, n->point = point;
  args->query->radius = point.distance;
  return true;
}

static nearest nearest_to(RTCScene scene, const prismarch_surface *surface, const float position[3], float radius) {
  nearest n;
  memset(&n, 0, sizeof n);
  n.surface = surface;
  struct RTCPointQuery query = {position[0], position[1], position[2], 0, radius};
  struct RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene, &query, &context, is_nearer, &n);
  return n;
}

static void point_queries(void) {
  begin("rtcPointQuery of the caller's own, with prismarch_surface_closest; also through an instance");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  RTCScene top = rtcNewScene(w.device);
  RTCGeometry instance = instance_of(w.device, w.scene, 4);
  rtcAttachGeometry(top, instance);
  rtcReleaseGeometry(instance);
  rtcCommitScene(top);
  for (int i = 0; i < 200; i++) {
    float at[3];
    for (int k = 0; k < 3; k++)
      at[k] = 4 * uniform() - 2;
    const float radius = i % 3 ? 10 : 0.3f;
    bool found = false;
    prismarch_closest_point p;
    EXPECT(prismarch_closest(w.scene, at, radius, 0, &found, &p, NULL) == PRISMARCH_OK);
    const nearest own = nearest_to(w.scene, w.surface, at, radius);
    EXPECT(own.found == found && (!found || (own.point.distance == p.distance && own.point.prim_id == p.prim_id)));
    EXPECT(!found || (own.calls > 0 && own.instances == 0));
    at[0] += 4;
    const nearest moved = nearest_to(top, w.surface, at, radius);
    EXPECT(moved.found == found && (!found || (moved.instances == 1 && fabsf(moved.point.distance - p.distance) < 1e-5f)));
    EXPECT(!found || fabsf(moved.point.position[0] - p.position[0] - 4) < 1e-3f);
  }
  prismarch_closest_point p;
  bool found;
  prismarch_error e;
  const float o[3] = {0, 0, 0};
  EXPECT(prismarch_surface_closest(w.surface, 1u << 30, o, 1, 0, NULL, &found, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(prismarch_surface_closest(w.surface, 0, o, -1, 0, NULL, &found, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  rtcReleaseScene(top);
  free_world(&w);
  end();
}

/* A grey 16-bit TIFF without compression, row 0 on top. */
static int write_tiff(const char *path, uint16_t width, uint16_t height, const uint16_t *texels) {
  FILE *file = fopen(path, "wb");
  if (!file)
    return 0;
  const uint16_t entries[][2] = {{256, width}, {257, height}, {258, 16}, {259, 1}, {262, 1}, {273, 122}, {277, 1}, {278, height}, {279, 0}};
  enum { COUNT = sizeof entries / sizeof *entries };
  const unsigned char header[8] = {'I', 'I', 42, 0, 8, 0, 0, 0};
  const uint16_t count = COUNT;
  fwrite(header, 1, sizeof header, file);
  fwrite(&count, sizeof count, 1, file);
  for (int i = 0; i < COUNT; i++) {
    const uint32_t bytes = 2u * width * height;
    const uint16_t type = 4;
    const uint32_t one = 1, value = entries[i][0] == 279 ? bytes : entries[i][1];
    fwrite(&entries[i][0], 2, 1, file);
    fwrite(&type, 2, 1, file);
    fwrite(&one, 4, 1, file);
    fwrite(&value, 4, 1, file);
  }
  const uint32_t last = 0;
  fwrite(&last, 4, 1, file);
  fwrite(texels, 2, (size_t)width * height, file);
  return fclose(file) == 0;
}

static void files(void) {
  begin("prismarch_map_load: the texels of a file, its bottom row first; broken files");
  char path[256];
  const char *folder = getenv("TMPDIR");
  snprintf(path, sizeof path, "%s/prismarch-%ld.tif", folder ? folder : "/tmp", (long)getpid());
  uint16_t texels[SIDE * SIDE], upside_down[SIDE * SIDE];
  noise(texels);
  for (int j = 0; j < SIDE; j++)
    memcpy(&upside_down[j * SIDE], &texels[(SIDE - 1 - j) * SIDE], SIDE * sizeof *texels);
  EXPECT(write_tiff(path, SIDE, SIDE, upside_down));
  prismarch_map *maps[2] = {NULL, NULL};
  prismarch_error e;
  const prismarch_texels t = {texels, PRISMARCH_TEXEL_U16, 0, 0};
  EXPECT(prismarch_map_load(path, NULL, PRISMARCH_WRAP_REPEAT, &maps[0], &e) == PRISMARCH_OK);
  EXPECT(prismarch_map_create(SIDE, SIDE, &t, PRISMARCH_WRAP_REPEAT, &maps[1], &e) == PRISMARCH_OK);
  const ball b = new_ball(1);
  prismarch_surface *surfaces[2] = {NULL, NULL};
  for (int k = 0; k < 2 && maps[0] && maps[1]; k++) {
    const prismarch_surface_desc d = desc_of(&b, maps[k]);
    surfaces[k] = surface_of(&d);
  }
  for (int i = 0; i < 200 && surfaces[0] && surfaces[1]; i++) {
    const uint32_t prim = (uint32_t)(uniform() * QUADS);
    const float u = uniform(), v = uniform();
    prismarch_point p[2];
    for (int k = 0; k < 2; k++)
      EXPECT(prismarch_interpolate(surfaces[k], prim, u, v, 0, &p[k], NULL) == PRISMARCH_OK);
    EXPECT(p[0].displacement == p[1].displacement);
  }
  EXPECT(truncate(path, 1000) == 0);
  prismarch_map *none = NULL;
  EXPECT(prismarch_map_load(path, NULL, PRISMARCH_WRAP_REPEAT, &none, &e) == PRISMARCH_ERROR_FILE && strstr(e.message, path));
  EXPECT(truncate(path, 0) == 0);
  EXPECT(prismarch_map_load(path, NULL, PRISMARCH_WRAP_REPEAT, &none, &e) == PRISMARCH_ERROR_FILE);
  EXPECT(none == NULL);
  remove(path);
  for (int k = 0; k < 2; k++) {
    prismarch_surface_release(surfaces[k]);
    prismarch_map_release(maps[k]);
  }
  end();
}

static void lifetimes(void) {
  begin("one surface in several devices and scenes, released in any order");
  const ball b = new_ball(1);
  for (int order = 0; order < 4; order++) {
    prismarch_map *map = new_map();
    const prismarch_surface_desc d = desc_of(&b, map);
    prismarch_surface *surface = surface_of(&d);
    RTCDevice devices[2];
    RTCScene scenes[4];
    for (int k = 0; k < 2; k++) {
      devices[k] = rtcNewDevice(NULL);
      RTCGeometry geometry = geometry_of(devices[k], surface);
      rtcCommitGeometry(geometry);
      for (int s = 0; s < 2; s++) {
        RTCScene scene = scenes[2 * k + s] = rtcNewScene(devices[k]);
        rtcAttachGeometry(scene, geometry);
        rtcCommitScene(scene);
      }
      rtcReleaseGeometry(geometry);
    }
    if (order & 1)
      prismarch_map_release(map);
    if (order & 2)
      prismarch_surface_release(surface);
    for (int s = 0; s < 4; s++) {
      const float o[3] = {3, 0.1f, 0.1f}, dir[3] = {-1, 0, 0};
      struct RTCRayHit q = ray_at(o, dir);
      intersect1(scenes[s], &q, NULL);
      EXPECT(is_hit(&q));
      rtcReleaseScene(scenes[s]);
    }
    for (int k = 0; k < 2; k++)
      rtcReleaseDevice(devices[k]);
    if (!(order & 2))
      prismarch_surface_release(surface);
    if (!(order & 1))
      prismarch_map_release(map);
  }
  end();
}

typedef struct tracing {
  RTCScene scene;
  int hits;
} tracing;

static void *trace(void *user) {
  tracing *t = user;
  for (int i = 0; i < 3000; i++) {
    const float a = 0.002f * (float)i;
    const float o[3] = {3 * cosf(a), 3 * sinf(a), 0.1f}, d[3] = {-cosf(a), -sinf(a), 0};
    struct RTCRayHit q = ray_at(o, d);
    intersect1(t->scene, &q, NULL);
    t->hits += is_hit(&q);
  }
  return NULL;
}

static void *join(void *scene) {
  rtcJoinCommitScene(scene);
  return NULL;
}

static void threads(void) {
  begin("threads trace one scene while another is committed; rtcJoinCommitScene");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  pthread_t all[3];
  tracing t[3];
  for (int k = 0; k < 3; k++) {
    t[k].scene = w.scene, t[k].hits = 0;
    pthread_create(&all[k], NULL, trace, &t[k]);
  }
  for (int k = 0; k < 10; k++) {
    RTCScene other = rtcNewScene(w.device);
    rtcAttachGeometry(other, w.geometry);
    pthread_t helper;
    pthread_create(&helper, NULL, join, other);
    rtcJoinCommitScene(other);
    pthread_join(helper, NULL);
    const float o[3] = {3, 0.1f, 0.1f}, d[3] = {-1, 0, 0};
    struct RTCRayHit q = ray_at(o, d);
    intersect1(other, &q, NULL);
    EXPECT(is_hit(&q));
    rtcReleaseScene(other);
  }
  for (int k = 0; k < 3; k++) {
    pthread_join(all[k], NULL);
    EXPECT(t[k].hits == 3000);
  }
  free_world(&w);
  end();
}

static long long held;
static long long most;
static bool monitor(void *user, ssize_t bytes, bool post) {
  (void)user;
  (void)post;
  const long long now = __sync_add_and_fetch(&held, (long long)bytes);
  if (bytes > 0 && most >= 0 && now > most) {
    __sync_fetch_and_sub(&held, (long long)bytes);
    return false;
  }
  return true;
}

static void memory(void) {
  begin("memory monitor: counted, and refused without a crash");
  for (int k = 0; k < 2; k++) {
    held = 0;
    most = k ? 1000 : -1;
    RTCDevice device = rtcNewDevice(NULL);
    rtcSetDeviceMemoryMonitorFunction(device, monitor, NULL);
    const ball b = new_ball(1);
    prismarch_map *map = new_map();
    const prismarch_surface_desc d = desc_of(&b, map);
    prismarch_surface *surface = surface_of(&d);
    RTCGeometry geometry = geometry_of(device, surface);
    rtcCommitGeometry(geometry);
    RTCScene scene = rtcNewScene(device);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    (void)rtcGetDeviceError(device);
    rtcCommitScene(scene);
    const enum RTCError error = rtcGetDeviceError(device);
    EXPECT(k ? error != RTC_ERROR_NONE : error == RTC_ERROR_NONE && held > 0);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    prismarch_surface_release(surface);
    prismarch_map_release(map);
  }
  end();
}

static void misuse(void) {
  begin("misuse: a status and a text, never a crash");
  prismarch_error e;
  ball b = new_ball(1);
  prismarch_map *map = new_map(), *no_map = NULL;
  prismarch_surface *surface = NULL;
  uint16_t texels[4] = {0};
  prismarch_texels t = {texels, PRISMARCH_TEXEL_U16, 0, 0};
  EXPECT(prismarch_map_create(0, 2, &t, PRISMARCH_WRAP_CLAMP, &no_map, &e) == PRISMARCH_ERROR_ARGUMENT && *e.message);
  EXPECT(prismarch_map_create(2, 2, NULL, PRISMARCH_WRAP_CLAMP, &no_map, &e) == PRISMARCH_ERROR_NULL);
  EXPECT(prismarch_map_create(2, 2, &t, PRISMARCH_WRAP_CLAMP, NULL, &e) == PRISMARCH_ERROR_NULL);
  EXPECT(prismarch_map_create(2, 2, &t, (prismarch_wrap)9, &no_map, NULL) == PRISMARCH_ERROR_ARGUMENT);
  const float nan_texels[4] = {0, NAN, 0, 0};
  const prismarch_texels nan = {nan_texels, PRISMARCH_TEXEL_F32, 0, 0};
  EXPECT(prismarch_map_create(2, 2, &nan, PRISMARCH_WRAP_CLAMP, &no_map, &e) == PRISMARCH_ERROR_DATA);
  EXPECT(prismarch_map_load("no such file.png", NULL, PRISMARCH_WRAP_CLAMP, &no_map, &e) == PRISMARCH_ERROR_FILE);
  EXPECT(prismarch_map_update(map, SIDE - 1, 0, 2, 2, &t, NULL, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(prismarch_map_update(map, 0, 0, 2, 2, &nan, NULL, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(no_map == NULL);

  prismarch_surface_desc d = desc_of(&b, map);
  d.struct_size = 3;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  d = desc_of(&b, NULL);
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_NULL);
  d = desc_of(&b, map);
  d.vertices.positions.stride = 4;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  d = desc_of(&b, map);
  d.time_step_count = 2;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_NULL);
  d = desc_of(&b, map);
  b.quads[3][1] = VERTICES;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_DATA);
  b = new_ball(1);
  b.positions[20][1] = NAN;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_DATA);
  b = new_ball(1);
  d.scale = NAN;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(surface == NULL);

  RTCGeometry geometry = NULL;
  RTCDevice device = rtcNewDevice(NULL);
  EXPECT(prismarch_geometry_create(device, NULL, &geometry, &e) == PRISMARCH_ERROR_NULL);
  d = desc_of(&b, map);
  surface = surface_of(&d);
  EXPECT(prismarch_geometry_create(NULL, surface, &geometry, &e) == PRISMARCH_ERROR_NULL);
  EXPECT(prismarch_geometry_create(device, (prismarch_surface *)map, &geometry, &e) == PRISMARCH_ERROR_HANDLE);
  EXPECT(geometry == NULL);
  prismarch_point p;
  EXPECT(prismarch_interpolate(surface, QUADS, 0.5f, 0.5f, 0, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(prismarch_interpolate(surface, 20, NAN, 0.5f, 0, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(prismarch_interpolate(surface, 20, 0.5f, 0.5f, 2, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(prismarch_surface_release(NULL) == PRISMARCH_OK);
  EXPECT(prismarch_map_release((prismarch_map *)surface) == PRISMARCH_ERROR_HANDLE);
  rtcReleaseDevice(device);
  EXPECT(prismarch_surface_retain(surface) == PRISMARCH_OK);
  for (int k = 0; k < 4; k++)
    EXPECT(prismarch_surface_release(surface) == (k < 2 ? PRISMARCH_OK : PRISMARCH_ERROR_HANDLE));
  EXPECT(prismarch_surface_retain(surface) == PRISMARCH_ERROR_HANDLE);
  for (int k = 0; k < 3; k++)
    EXPECT(prismarch_map_release(map) == (k < 1 ? PRISMARCH_OK : PRISMARCH_ERROR_HANDLE));
  end();
}

int main(void) {
  setvbuf(stdout, NULL, _IOLBF, 0);
  printf("prismarch %u, Embree %u\n", prismarch_version(), prismarch_embree_version());
  bounds();
  interpolation();
  interval();
  masks();
  filters();
  packets4();
  packets8();
  packets16();
  instances();
  odd_rays();
  watertight();
  edits();
  motion();
  closest();
  point_queries();
  files();
  lifetimes();
  threads();
  memory();
  misuse();
  printf("%d of the cases failed\n", failures);
  return failures != 0;
}
