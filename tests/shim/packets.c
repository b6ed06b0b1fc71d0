/* Packets: more than the Rust side ever sends, but pipelines do. One ball behind the shim's callbacks, traced
 * by single rays and by packets of 4, 8 and 16 with a third of the lanes off, with a hit test for packets and
 * without; then the same with a filter. The callbacks are also handed more lanes than any packet has.
 *
 * Includes the shim itself, which brings Embree's own calls. */
#include "../../ffi/shim.c"
#include "../../ffi/user_geometry.c"

#include <stdio.h>

static int failures;

#define CHECK(what)                                                                                        \
  do {                                                                                                     \
    if (!(what)) {                                                                                         \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #what);                                           \
      failures++;                                                                                          \
    }                                                                                                      \
  } while (0)

/* The ball is primitive 0; what it reports is another number, as a primitive that holds many does. */
enum { REPORTED_PRIM = 41 };

static unsigned packet_tests;

static void ball_bounds(const void *user, uint32_t prim, uint32_t step, float out[6]) {
  (void)user;
  (void)prim;
  (void)step;
  for (int k = 0; k < 6; k++)
    out[k] = k < 3 ? -1.001f : 1.001f;
}

static bool ball_intersect(const void *user, uint32_t prim, const pm_ray *ray, pm_hit *hit) {
  (void)user;
  float a = 0, b = 0, c = -1;
  for (int k = 0; k < 3; k++) {
    a += ray->dir[k] * ray->dir[k];
    b += ray->org[k] * ray->dir[k];
    c += ray->org[k] * ray->org[k];
  }
  const float root = sqrtf(b * b - a * c);
  const float near = (-b - root) / a, far = (-b + root) / a;
  const float t = near > ray->tnear ? near : far;
  if (!(t > ray->tnear && t < ray->tfar))
    return false;
  hit->t = t;
  hit->prim = prim + REPORTED_PRIM;
  hit->u = 0.25f;
  hit->v = 0.5f;
  for (int k = 0; k < 3; k++)
    hit->ng[k] = ray->org[k] + t * ray->dir[k];
  return true;
}

static bool ball_occluded(const void *user, uint32_t prim, const pm_ray *ray) {
  pm_hit hit;
  return ball_intersect(user, prim, ray, &hit);
}

static uint32_t ball_intersect8(const void *user, uint32_t prim, const pm_ray8 *rays, uint32_t valid,
                                pm_hit hits[PM_LANES]) {
  uint32_t found = 0;
  packet_tests++;
  CHECK(valid != 0 && valid < 256);
  for (unsigned i = 0; i < PM_LANES; i++) {
    pm_ray ray;
    load_words(&ray, rays, RAY_WORDS, PM_LANES, i);
    if (valid >> i & 1)
      found |= (uint32_t)ball_intersect(user, prim, &ray, &hits[i]) << i;
  }
  return found | ~valid; /* the shim must not believe the lanes it did not ask about */
}

static uint32_t ball_occluded8(const void *user, uint32_t prim, const pm_ray8 *rays, uint32_t valid) {
  pm_hit hits[PM_LANES];
  return ball_intersect8(user, prim, rays, valid, hits);
}

static const pm_hit_test BALL = {.bounds = ball_bounds, .intersect = ball_intersect, .occluded = ball_occluded};
static const pm_hit_test PACKET_BALL = {
    .bounds = ball_bounds, .intersect = ball_intersect, .occluded = ball_occluded, .intersect8 = ball_intersect8, .occluded8 = ball_occluded8};

/* Lets leaving crossings pass and drops entering ones. */
static bool leaving(const void *user, const pm_ray *ray, const pm_scene_hit *hit) {
  (void)user;
  CHECK(ray->tfar == hit->at.t);
  float cosine = 0;
  for (int k = 0; k < 3; k++)
    cosine += hit->at.ng[k] * ray->dir[k];
  return cosine > 0;
}

static void fail_error(const void *user, int code, const char *message) {
  (void)user;
  fprintf(stderr, "error %d: %s\n", code, message);
  failures++;
}

static bool no_limit(const void *user, int64_t bytes, bool post) {
  (void)user;
  (void)bytes;
  (void)post;
  return true;
}

/* Lane i: along +z, the further off the axis the higher i; the last ones miss. */
static pm_ray lane(unsigned i) {
  return (pm_ray){.org = {0.15f * (float)(i % 8), 0, -5}, .dir = {0, 0, 2}, .tfar = INFINITY, .mask = 1, .id = i};
}

static void trace(RTCScene scene, unsigned n, const int *valid, struct RTCRayHit16 *query, bool occluded) {
#if PM_EMBREE_MAJOR == 3
  struct RTCIntersectContext context;
  rtcInitIntersectContext(&context);
#define CALL(kind, n) rtc##kind##n(valid, scene, &context, (void *)query)
#else
#define CALL(kind, n) rtc##kind##n(valid, scene, (void *)query, NULL)
#endif
  if (n == 4)
    occluded ? CALL(Occluded, 4) : CALL(Intersect, 4);
  if (n == 8)
    occluded ? CALL(Occluded, 8) : CALL(Intersect, 8);
  if (n == 16)
    occluded ? CALL(Occluded, 16) : CALL(Intersect, 16);
}

static float word(const void *lanes, unsigned w, unsigned n, unsigned i) {
  float value;
  memcpy(&value, (const char *)lanes + 4 * ((size_t)w * n + i), 4);
  return value;
}

static uint32_t id_word(const void *lanes, unsigned w, unsigned n, unsigned i) {
  uint32_t value;
  memcpy(&value, (const char *)lanes + 4 * ((size_t)w * n + i), 4);
  return value;
}

static void check_lane(const pm_scene *scene, const void *rays, unsigned n, unsigned i, bool active, bool occluded) {
  const pm_ray ray = lane(i);
  pm_scene_hit one;
  const bool hit = active && pm_intersect1(scene, &ray, &one);
  const float tfar = word(rays, TFAR_WORD, n, i);
  if (occluded) {
    CHECK(tfar == (hit ? -INFINITY : INFINITY));
    CHECK(!active || hit == pm_occluded1(scene, &ray));
    return;
  }
  const char *hits = (const char *)rays + sizeof(struct RTCRay) * n;
  CHECK(tfar == (hit ? one.at.t : INFINITY));
  CHECK(id_word(hits, 6, n, i) == (hit ? one.geom : PM_INVALID_ID));
  if (!hit)
    return;
  for (unsigned k = 0; k < 3; k++)
    CHECK(word(hits, k, n, i) == one.at.ng[k]);
  CHECK(word(hits, 3, n, i) == 0.25f && word(hits, 4, n, i) == 0.5f);
  CHECK(id_word(hits, 5, n, i) == one.at.prim && one.at.prim == REPORTED_PRIM);
  CHECK(id_word(hits, 7, n, i) == one.inst[0]);
}

static void check_packet(const pm_scene *scene, unsigned n, bool occluded) {
  struct RTCRayHit16 query;
  _Alignas(64) int valid[16];
  memset(&query, 0xff, sizeof query); /* every id invalid */
  for (unsigned i = 0; i < n; i++) {
    const pm_ray ray = lane(i);
    store_words(&query, &ray, RAY_WORDS, n, i);
    valid[i] = i % 3 == 1 ? 0 : -1;
  }
  trace((RTCScene)scene, n, valid, &query, occluded);
  for (unsigned i = 0; i < n; i++)
    check_lane(scene, &query, n, i, valid[i] == -1, occluded);
}

/* The shim's own packets, all masks; lanes that are off hold no ray at all. */
static void check_masks(const pm_scene *scene, bool coherent) {
  for (uint32_t valid = 0; valid < 256; valid++) {
    pm_ray8 rays;
    pm_scene_hit hits[PM_LANES];
    memset(&rays, 0xff, sizeof rays);
    for (unsigned i = 0; i < PM_LANES; i++) {
      const pm_ray ray = lane(i);
      if (valid >> i & 1)
        store_words(&rays, &ray, RAY_WORDS, PM_LANES, i);
    }
    const uint32_t found = pm_intersect8(scene, &rays, valid, coherent, hits);
    CHECK(found == pm_occluded8(scene, &rays, valid, coherent));
    for (unsigned i = 0; i < PM_LANES; i++) {
      const pm_ray ray = lane(i);
      pm_scene_hit one;
      const bool hit = (valid >> i & 1) && pm_intersect1(scene, &ray, &one);
      CHECK(hit == (found >> i & 1));
      CHECK(!hit || memcmp(&one, &hits[i], sizeof one) == 0);
    }
  }
}

/* Callbacks with a number of lanes that is no packet's. */
static void check_lanes(const pm_scene *scene, pm_geometry *geometry, unsigned n) {
  enum { MOST = 80 };
  static _Alignas(64) uint32_t words[MOST * (RAY_WORDS + HIT_WORDS)];
  int valid[MOST];
  query_context context;
#if PM_EMBREE_MAJOR == 3
  rtcInitIntersectContext(&context);
#else
  rtcInitRayQueryContext(&context);
#endif
  for (int occluded = 0; occluded < 2; occluded++) {
    memset(words, 0xff, sizeof words);
    for (unsigned i = 0; i < n; i++) {
      const pm_ray ray = lane(i);
      store_words(words, &ray, RAY_WORDS, n, i);
      valid[i] = i % 3 == 1 ? 0 : -1;
    }
    if (occluded) {
      const struct RTCOccludedFunctionNArguments args = {
          .valid = valid, .geometryUserPtr = geometry, .context = &context, .ray = (struct RTCRayN *)words, .N = n};
      on_occluded(&args);
    } else {
      const struct RTCIntersectFunctionNArguments args = {.valid = valid,
                                                          .geometryUserPtr = geometry,
                                                          .context = &context,
                                                          .rayhit = (struct RTCRayHitN *)words,
                                                          .N = n};
      on_intersect(&args);
    }
    for (unsigned i = 0; i < n; i++)
      check_lane(scene, words, n, i, i % 3 != 1, occluded);
  }
}

static void check_scene(const pm_scene *scene, float expected_t) {
  const pm_ray ray = lane(0);
  pm_scene_hit hit;
  CHECK(pm_intersect1(scene, &ray, &hit) && hit.at.t == expected_t);
  for (unsigned n = 4; n <= 16; n *= 2) {
    check_packet(scene, n, false);
    check_packet(scene, n, true);
  }
  check_masks(scene, false);
  check_masks(scene, true);
}

static pm_scene *scene_with(const pm_device *device, pm_geometry *geometry) {
  pm_scene *scene = pm_scene_new(device, PM_QUALITY_MEDIUM, 0);
  pm_geometry_commit(geometry);
  pm_scene_attach(scene, geometry, 0);
  pm_scene_commit(scene);
  return scene;
}

static void check_ball(const pm_device *device, bool filtered, const pm_hit_test *test) {
  const float expected_t = filtered ? 3.0f : 2.0f; /* the direction's length is 2 */
  pm_geometry *ball = pm_geometry_new_user(device, test, NULL, 1, 1);
  if (filtered)
    pm_geometry_set_filter(ball, leaving, NULL);
  packet_tests = 0;
  pm_scene *inner = scene_with(device, ball);
  check_scene(inner, expected_t);
  const unsigned sizes[] = {2, 5, 8, 12, 16, 20, 64, 77};
  if (test->intersect8 && !filtered) /* filters are run by Embree, which does not make these calls */
    for (unsigned k = 0; k < sizeof sizes / sizeof *sizes; k++)
      check_lanes(inner, ball, sizes[k]);

  const float lifted[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 2};
  pm_geometry *instance = pm_geometry_new_instance(device, inner, lifted);
  pm_scene *outer = scene_with(device, instance);
  check_scene(outer, expected_t + 1.0f);
  CHECK((packet_tests > 0) == (test->intersect8 && !filtered));

  pm_scene_free(outer);
  pm_scene_free(inner);
  pm_geometry_free(instance);
  pm_geometry_free(ball);
}

int main(void) {
  int error;
  pm_device *device = pm_device_new("threads=1", NULL, fail_error, no_limit, &error);
  if (!device)
    return 2;
  for (int filtered = 0; filtered < 2; filtered++)
    for (int packets = 0; packets < 2; packets++)
      check_ball(device, filtered, packets ? &PACKET_BALL : &BALL);
  pm_device_free(device);
  if (!failures)
    printf("packets agree with single rays on Embree %s\n", RTC_VERSION_STRING);
  return failures != 0;
}
