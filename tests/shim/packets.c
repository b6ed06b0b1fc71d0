/* Packets: what the Rust side never sends, but pipelines do. One ball behind the shim's callbacks, traced
 * by single rays and by packets of 4, 8 and 16 with half of the lanes off; then the same with a filter.
 *
 * Includes the shim itself, which brings Embree's own calls. */
#include "../../ffi/shim.c"

#include <stdio.h>

static int failures;

#define CHECK(what)                                                                                        \
  do {                                                                                                     \
    if (!(what)) {                                                                                         \
      fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #what);                                           \
      failures++;                                                                                          \
    }                                                                                                      \
  } while (0)

static void ball_bounds(const void *user, uint32_t prim, float out[6]) {
  (void)user;
  (void)prim;
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
  hit->prim = prim;
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

static const pm_hit_test BALL = {ball_bounds, ball_intersect, ball_occluded};

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
  CHECK(id_word(hits, 5, n, i) == one.prim);
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

static void check_scene(const pm_scene *scene, float expected_t) {
  const pm_ray ray = lane(0);
  pm_scene_hit hit;
  CHECK(pm_intersect1(scene, &ray, &hit) && hit.at.t == expected_t);
  for (unsigned n = 4; n <= 16; n *= 2) {
    check_packet(scene, n, false);
    check_packet(scene, n, true);
  }
}

static pm_scene *scene_with(const pm_device *device, pm_geometry *geometry) {
  pm_scene *scene = pm_scene_new(device, PM_QUALITY_MEDIUM, 0);
  pm_geometry_commit(geometry);
  pm_scene_attach(scene, geometry, 0);
  pm_scene_commit(scene);
  return scene;
}

int main(void) {
  int error;
  pm_device *device = pm_device_new("threads=1", NULL, fail_error, no_limit, &error);
  if (!device)
    return 2;
  for (int filtered = 0; filtered < 2; filtered++) {
    const float expected_t = filtered ? 3.0f : 2.0f; /* the direction's length is 2 */
    pm_geometry *ball = pm_geometry_new_user(device, &BALL, NULL, 1);
    if (filtered)
      pm_geometry_set_filter(ball, leaving, NULL);
    pm_scene *inner = scene_with(device, ball);
    check_scene(inner, expected_t);

    const float lifted[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 2};
    pm_geometry *instance = pm_geometry_new_instance(device, inner, lifted);
    pm_scene *outer = scene_with(device, instance);
    check_scene(outer, expected_t + 1.0f);

    pm_scene_free(outer);
    pm_scene_free(inner);
    pm_geometry_free(instance);
    pm_geometry_free(ball);
  }
  pm_device_free(device);
  if (!failures)
    printf("packets agree with single rays on Embree %s\n", RTC_VERSION_STRING);
  return failures != 0;
}
