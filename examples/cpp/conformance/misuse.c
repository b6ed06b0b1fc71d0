/* What a caller must not do: a status and a text, never a crash. */
#include "ball.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

void misuse(void) {
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

/* Every function that takes a map, with something that is none. */
static void expect_no_map(prismarch_map *wild) {
  prismarch_error e;
  uint32_t width, height;
  const uint16_t texel = 0;
  const prismarch_texels t = {&texel, PRISMARCH_TEXEL_U16, 0, 0};
  EXPECT(prismarch_map_size(wild, &width, &height, &e) == PRISMARCH_ERROR_HANDLE && *e.message);
  EXPECT(prismarch_map_update(wild, 0, 0, 1, 1, &t, NULL, &e) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_map_retain(wild) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_map_release(wild) == PRISMARCH_ERROR_HANDLE);
  const ball b = new_ball(1);
  const prismarch_surface_desc d = desc_of(&b, wild);
  prismarch_surface *surface = NULL;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_HANDLE && surface == NULL);
}

/* Every function that takes a surface. */
static void expect_no_surface(RTCDevice device, prismarch_surface *wild) {
  prismarch_error e;
  const ball b = new_ball(1);
  prismarch_vertices v;
  memset(&v, 0, sizeof v);
  v.positions.data = b.positions;
  prismarch_point p;
  prismarch_closest_point c;
  const uint32_t prim = 0;
  const float u = 0.5f, at[3] = {0, 0, 0};
  size_t bytes;
  bool found;
  RTCGeometry geometry = NULL;
  EXPECT(prismarch_surface_update_vertices(wild, 0, &v, NULL, &e) == PRISMARCH_ERROR_HANDLE && *e.message);
  EXPECT(prismarch_surface_check(wild, &e) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_surface_bytes(wild, &bytes, &e) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_interpolate(wild, 0, 0.5f, 0.5f, 0, &p, &e) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_interpolate_n(wild, NULL, &prim, &u, &u, 1, 0, &p, &e) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_geometry_create(device, wild, &geometry, &e) == PRISMARCH_ERROR_HANDLE && geometry == NULL);
  EXPECT(prismarch_surface_closest(wild, 0, at, 1, 0, NULL, &found, &c, &e) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_surface_retain(wild) == PRISMARCH_ERROR_HANDLE);
  EXPECT(prismarch_surface_release(wild) == PRISMARCH_ERROR_HANDLE);
}

void handles(void) {
  begin("wild, stale and foreign handles, and those of another kind, get a status in every function");
  world w = new_world(RTC_SCENE_FLAG_NONE), gone = new_world(RTC_SCENE_FLAG_NONE);
  free_world(&gone);
  /* Whatever memory they have, they are others than those that are gone. */
  world young = new_world(RTC_SCENE_FLAG_NONE);
  EXPECT(young.map != gone.map && young.surface != gone.surface);
  int local = 0;
  void *heap = malloc(64);
  void *const wild[] = {gone.map, gone.surface,          &local,   heap,           (void *)(uintptr_t)8,
                        w.scene,  w.geometry,            w.device, (void *)&handles, (void *)UINTPTR_MAX,
                        (char *)heap + 1, (void *)((uintptr_t)w.map ^ 1u << 16)};
  for (unsigned i = 0; i < sizeof wild / sizeof *wild; i++) {
    expect_no_map((prismarch_map *)wild[i]);
    expect_no_surface(w.device, (prismarch_surface *)wild[i]);
  }
  expect_no_map((prismarch_map *)w.surface);
  expect_no_surface(w.device, (prismarch_surface *)w.map);
  free(heap);
  prismarch_point p;
  EXPECT(prismarch_interpolate(w.surface, 20, 0.5f, 0.5f, 0, &p, NULL) == PRISMARCH_OK);
  free_world(&young);
  free_world(&w);
  end();
}

void geometries(void) {
  begin("user data: of prismarch's own geometries alone, as long as they live");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  prismarch_error e;
  int data = 0;
  RTCGeometry mesh = rtcNewGeometry(w.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  RTCGeometry user = rtcNewGeometry(w.device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserData(user, &data);
  const RTCGeometry others[] = {mesh, user, (RTCGeometry)&data, (RTCGeometry)w.surface, (RTCGeometry)(uintptr_t)1};
  for (unsigned i = 0; i < sizeof others / sizeof *others; i++) {
    EXPECT(prismarch_geometry_set_user_data(others[i], &data, &e) == PRISMARCH_ERROR_HANDLE && *e.message);
    EXPECT(prismarch_geometry_user_data(others[i]) == NULL);
  }
  EXPECT(rtcGetGeometryUserData(user) == &data);
  EXPECT(prismarch_geometry_set_user_data(NULL, &data, &e) == PRISMARCH_ERROR_NULL);
  EXPECT(prismarch_geometry_user_data(NULL) == NULL);
  EXPECT(prismarch_geometry_user_data(w.geometry) == NULL);
  EXPECT(prismarch_geometry_set_user_data(w.geometry, &data, &e) == PRISMARCH_OK);
  EXPECT(prismarch_geometry_user_data(w.geometry) == &data);
  for (int k = 0; k < 3; k++) {
    /* Another reference keeps it; a scene that it is attached to does so, too. */
    RTCGeometry stale = geometry_of(w.device, w.surface);
    RTCScene scene = rtcNewScene(w.device);
    rtcAttachGeometry(scene, stale);
    rtcRetainGeometry(stale);
    rtcReleaseGeometry(stale);
    rtcReleaseGeometry(stale);
    EXPECT(prismarch_geometry_set_user_data(stale, &data, &e) == PRISMARCH_OK);
    rtcReleaseScene(scene);
    if (prismarch_geometry_keeps_surface()) {
      EXPECT(prismarch_geometry_set_user_data(stale, &data, &e) == PRISMARCH_ERROR_HANDLE);
      EXPECT(prismarch_geometry_user_data(stale) == NULL);
    }
  }
  rtcReleaseGeometry(mesh);
  rtcReleaseGeometry(user);
  free_world(&w);
  end();
}

void descriptions(void) {
  begin("descriptions of older and newer headers: what they lack has its default, what is unknown is refused");
  const ball b = new_ball(1);
  prismarch_map *map = new_map();
  prismarch_error e;
  prismarch_surface *surface = NULL;
  const prismarch_surface_desc present = desc_of(&b, map);
  EXPECT(present.struct_size == sizeof present && present.has_filter);

  /* The first version's, in no more memory than that took; its function writes no further. */
  const size_t first = offsetof(prismarch_surface_desc, has_filter);
  unsigned char *const memory = malloc(first);
  prismarch_surface_desc *const old = (prismarch_surface_desc *)(void *)memory;
  size_t told = 0;
  EXPECT((prismarch_surface_desc_init)(old) == PRISMARCH_OK);
  memcpy(&told, memory, sizeof told);
  EXPECT(told == first);
  memcpy(memory, &present, first);
  memcpy(memory, &first, sizeof first);
  EXPECT(prismarch_surface_create(old, &surface, &e) == PRISMARCH_OK);
  prismarch_surface_release(surface);
  told = first - 1;
  memcpy(memory, &told, sizeof told);
  EXPECT(prismarch_surface_create(old, &surface, &e) == PRISMARCH_ERROR_ARGUMENT && *e.message);
  free(memory);

  /* A later one's. */
  unsigned char later[sizeof present + 16];
  EXPECT(prismarch_surface_desc_init_sized((prismarch_surface_desc *)(void *)later, sizeof later) == PRISMARCH_OK);
  memcpy(later, &present, sizeof present);
  const size_t size = sizeof later;
  memcpy(later, &size, sizeof size);
  EXPECT(prismarch_surface_create((prismarch_surface_desc *)(void *)later, &surface, &e) == PRISMARCH_OK);
  prismarch_surface_release(surface);
  later[sizeof present + 3] = 1;
  EXPECT(prismarch_surface_create((prismarch_surface_desc *)(void *)later, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  prismarch_surface_desc d = present;
  for (int k = 0; k < 2; k++) {
    d.struct_size = k ? SIZE_MAX : 0;
    EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
    EXPECT(prismarch_surface_desc_init_sized(&d, k ? SIZE_MAX : 0) == PRISMARCH_ERROR_ARGUMENT);
  }
  EXPECT(prismarch_surface_desc_init(NULL) == PRISMARCH_ERROR_NULL);
  prismarch_map_release(map);
  end();
}

void counts(void) {
  begin("counts, strides and offsets that no memory has get a status");
  const ball b = new_ball(1);
  prismarch_map *map = new_map();
  prismarch_surface *surface = NULL;
  prismarch_error e;
  const prismarch_surface_desc good = desc_of(&b, map);
  prismarch_surface_desc d = good;
  d.vertex_count = d.primitive_count = UINT32_MAX;
  d.indices.data = d.vertices.positions.data = d.texcoords.data = NULL;
  EXPECT(prismarch_surface_create(&d, &surface, &e) != PRISMARCH_OK);
  d = good;
  d.vertex_count = UINT32_MAX;
  d.texcoords.data = NULL;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_NULL);
  d = good;
  d.primitive_count = UINT32_MAX;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  d = good;
  d.vertices.positions.stride = SIZE_MAX / 2;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  d = good;
  d.texcoords.offset = SIZE_MAX - 3;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  d = good;
  d.time_step_count = UINT32_MAX;
  d.later_steps = &good.vertices;
  EXPECT(prismarch_surface_create(&d, &surface, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(surface == NULL);

  prismarch_map *none = NULL;
  const uint16_t texel = 0;
  prismarch_texels t = {&texel, PRISMARCH_TEXEL_U16, 0, 0};
  EXPECT(prismarch_map_create(UINT32_MAX, UINT32_MAX, &t, PRISMARCH_WRAP_CLAMP, &none, &e) == PRISMARCH_ERROR_ARGUMENT);
  t.row_stride = PTRDIFF_MIN;
  EXPECT(prismarch_map_create(2, 2, &t, PRISMARCH_WRAP_CLAMP, &none, &e) == PRISMARCH_ERROR_ARGUMENT);
  t.data = NULL;
  EXPECT(prismarch_map_create(32768, 32768, &t, PRISMARCH_WRAP_CLAMP, &none, &e) == PRISMARCH_ERROR_NULL && !none);
  EXPECT(prismarch_map_update(map, UINT32_MAX, UINT32_MAX, UINT32_MAX, UINT32_MAX, &t, NULL, &e) == PRISMARCH_ERROR_ARGUMENT);
  prismarch_map_release(map);
  end();
}

void limits(void) {
  begin("what lies beyond the numbers that Embree takes: surfaces and points get a status");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  prismarch_surface *surface = NULL;
  prismarch_error e;
  const float too_far[] = {1.9e18f, 1e30f, 3e38f};
  for (int i = 0; i < 3; i++) {
    const ball far = new_ball(too_far[i]);
    prismarch_surface_desc d = desc_of(&far, w.map);
    EXPECT(prismarch_surface_create(&d, &surface, &e) != PRISMARCH_OK && surface == NULL && *e.message);
    prismarch_vertices v = d.vertices;
    EXPECT(prismarch_surface_update_vertices(w.surface, 0, &v, NULL, &e) != PRISMARCH_OK);
    const ball near = new_ball(1);
    d = desc_of(&near, w.map);
    d.scale = too_far[i];
    EXPECT(prismarch_surface_create(&d, &surface, &e) != PRISMARCH_OK && surface == NULL);
  }
  const float odd[] = {1.9e18f, -1e30f, INFINITY, NAN};
  bool found = false;
  prismarch_closest_point p;
  for (int i = 0; i < 4; i++) {
    const float at[3] = {0, odd[i], 0}, o[3] = {3, 0, 0};
    float transform[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    EXPECT(prismarch_closest(w.scene, at, 1, 0, &found, &p, &e) == PRISMARCH_ERROR_ARGUMENT && *e.message);
    EXPECT(prismarch_surface_closest(w.surface, 0, at, 1, 0, NULL, &found, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
    transform[12] = odd[i];
    EXPECT(prismarch_surface_closest(w.surface, 0, o, 1, 0, transform, &found, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  }
  /* However far is what a radius may say. */
  const float o[3] = {3, 0, 0}, radii[] = {10, 1e30f, INFINITY};
  for (int i = 0; i < 3; i++)
    EXPECT(prismarch_closest(w.scene, o, radii[i], 0, &found, &p, &e) == PRISMARCH_OK && found && p.distance < 2.1f);
  EXPECT(prismarch_closest(w.scene, o, -1, 0, &found, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(prismarch_closest(w.scene, o, NAN, 0, &found, &p, &e) == PRISMARCH_ERROR_ARGUMENT);
  EXPECT(prismarch_surface_check(w.surface, &e) == PRISMARCH_OK);
  free_world(&w);
  end();
}
