/* What changes while it is traced, who owns what, and how much of it there is. */
#define _POSIX_C_SOURCE 200809L
#include "ball.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

void edits(void) {
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

void motion(void) {
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

void lifetimes(void) {
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
    /* Where geometries do not keep it, it goes last. */
    const bool early = order & 2 && prismarch_geometry_keeps_surface();
    if (early)
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
    if (!early)
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

void threads(void) {
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

/* Written and read by several threads. */
static int is_done, is_waiting;
static int get(const int *flag) { return __atomic_load_n(flag, __ATOMIC_ACQUIRE); }
static void wait_a_little(void) {
  const struct timespec moment = {0, 200000};
  nanosleep(&moment, NULL);
}
static void set(int *flag, int value) { __atomic_store_n(flag, value, __ATOMIC_RELEASE); }

static void *trace_until_done(void *user) {
  tracing *t = user;
  for (int i = 0; !get(&is_done); i++) {
    const float a = 0.002f * (float)i;
    const float o[3] = {3 * cosf(a), 3 * sinf(a), 0.1f}, d[3] = {-cosf(a), -sinf(a), 0};
    struct RTCRayHit q = ray_at(o, d);
    intersect1(t->scene, &q, NULL);
    struct RTCRayHit s = ray_at(o, d);
    occluded1(t->scene, &s.ray, NULL);
    t->hits += is_hit(&q) && s.ray.tfar < 0 && q.ray.tfar > 1 && q.ray.tfar < 3;
    if (i % 16 == 0)
      wait_a_little(); /* Valgrind gives the other threads no turn otherwise. */
  }
  return NULL;
}

/* Keeps its ray in flight until it is told. */
static void wait_in_filter(const struct RTCFilterFunctionNArguments *args) {
  (void)args;
  set(&is_waiting, 1);
  while (!get(&is_done))
    wait_a_little();
}

static void *trace_one(void *user) {
  tracing *t = user;
  const float o[3] = {3, 0.1f, 0.1f}, d[3] = {-1, 0, 0};
  struct RTCRayHit q = ray_at(o, d);
  intersect1(t->scene, &q, NULL);
  t->hits += is_hit(&q);
  return NULL;
}

void updates_beside_rays(void) {
  begin("updates beside rays: PRISMARCH_ERROR_IN_FLIGHT or done, never half");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  const ball b = new_ball(1), larger = new_ball(1.2f);
  prismarch_vertices v[2];
  memset(v, 0, sizeof v);
  v[0].positions.data = larger.positions, v[0].normals.data = larger.normals;
  v[1].positions.data = b.positions, v[1].normals.data = b.normals;
  static uint16_t texels[SIDE * SIDE];
  const prismarch_texels t = {texels, PRISMARCH_TEXEL_U16, 0, 0};

  /* While one ray waits in its filter. */
  tracing one = {w.scene, 0};
  pthread_t thread;
  rtcSetGeometryIntersectFilterFunction(w.geometry, wait_in_filter);
  rtcCommitGeometry(w.geometry);
  rtcCommitScene(w.scene);
  set(&is_done, 0);
  set(&is_waiting, 0);
  pthread_create(&thread, NULL, trace_one, &one);
  while (!get(&is_waiting))
    wait_a_little();
  prismarch_error e;
  bool needed = false;
  EXPECT(prismarch_surface_update_vertices(w.surface, 0, &v[0], &needed, &e) == PRISMARCH_ERROR_IN_FLIGHT && *e.message);
  EXPECT(prismarch_map_update(w.map, 0, 0, SIDE, SIDE, &t, &needed, &e) == PRISMARCH_ERROR_IN_FLIGHT);
  EXPECT(!needed);
  set(&is_done, 1);
  pthread_join(thread, NULL);
  EXPECT(one.hits == 1);
  EXPECT(prismarch_surface_update_vertices(w.surface, 0, &v[1], &needed, &e) == PRISMARCH_OK && needed);
  rtcSetGeometryIntersectFilterFunction(w.geometry, NULL);
  rtcCommitGeometry(w.geometry);
  rtcCommitScene(w.scene);

  /* Beside two threads that do not stop. */
  enum { ROUNDS = 50 };
  tracing all[2] = {{w.scene, 0}, {w.scene, 0}};
  pthread_t threads[2];
  set(&is_done, 0);
  for (int k = 0; k < 2; k++)
    pthread_create(&threads[k], NULL, trace_until_done, &all[k]);
  for (int i = 0; i < ROUNDS; i++) {
    const prismarch_status moved = prismarch_surface_update_vertices(w.surface, 0, &v[i & 1], NULL, &e);
    const prismarch_status edited = prismarch_map_update(w.map, 0, 0, SIDE, SIDE, &t, NULL, &e);
    EXPECT(moved == PRISMARCH_OK || moved == PRISMARCH_ERROR_IN_FLIGHT);
    EXPECT(edited == PRISMARCH_OK || edited == PRISMARCH_ERROR_IN_FLIGHT);
  }
  set(&is_done, 1);
  for (int k = 0; k < 2; k++) {
    pthread_join(threads[k], NULL);
    EXPECT(all[k].hits > 0);
  }
  EXPECT(prismarch_surface_update_vertices(w.surface, 0, &v[1], NULL, &e) == PRISMARCH_OK);
  EXPECT(prismarch_surface_check(w.surface, &e) == PRISMARCH_OK);
  free_world(&w);
  end();
}

static void *interpolate_until_gone(void *surface) {
  prismarch_point p;
  prismarch_status status;
  do {
    set(&is_waiting, 1);
    status = prismarch_interpolate(surface, 20, 0.5f, 0.5f, 0, &p, NULL);
    wait_a_little();
  } while (status == PRISMARCH_OK);
  return status == PRISMARCH_ERROR_HANDLE ? surface : NULL;
}

void handles_beside_releases(void) {
  begin("a handle that another thread releases is whole to the end of the call");
  const ball b = new_ball(1);
  for (int round = 0; round < 20; round++) {
    prismarch_map *map = new_map();
    const prismarch_surface_desc d = desc_of(&b, map);
    prismarch_surface *surface = surface_of(&d);
    pthread_t threads[2];
    set(&is_waiting, 0);
    for (int k = 0; k < 2; k++)
      pthread_create(&threads[k], NULL, interpolate_until_gone, surface);
    while (!get(&is_waiting))
      wait_a_little();
    EXPECT(prismarch_surface_release(surface) == PRISMARCH_OK);
    for (int k = 0; k < 2; k++) {
      void *told = NULL;
      pthread_join(threads[k], &told);
      EXPECT(told == surface);
    }
    EXPECT(prismarch_map_release(map) == PRISMARCH_OK);
  }
  end();
}

static long long held;
static long long most;
static bool monitor(void *user, ssize_t bytes, bool post) {
  (void)user;
  (void)post;
  const long long now = __sync_add_and_fetch(&held, (long long)bytes), limit = __atomic_load_n(&most, __ATOMIC_ACQUIRE);
  if (bytes > 0 && limit >= 0 && now > limit) {
    __sync_fetch_and_sub(&held, (long long)bytes);
    return false;
  }
  return true;
}

void memory(void) {
  begin("memory monitor: counted, and refused without a crash");
  for (int k = 0; k < 2; k++) {
    __atomic_store_n(&held, 0, __ATOMIC_RELEASE);
    __atomic_store_n(&most, k ? 1000 : -1, __ATOMIC_RELEASE);
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
    EXPECT(k ? error != RTC_ERROR_NONE : error == RTC_ERROR_NONE && __atomic_load_n(&held, __ATOMIC_ACQUIRE) > 0);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    prismarch_surface_release(surface);
    prismarch_map_release(map);
  }
  end();
}
