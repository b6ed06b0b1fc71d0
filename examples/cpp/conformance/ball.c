#include "ball.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

int failures;
static const char *case_name;
static int case_failed;

void begin(const char *name) {
  case_name = name;
  case_failed = 0;
}

void expect(int holds, const char *what) {
  if (holds || case_failed)
    return;
  case_failed = 1;
  failures++;
  printf("FAIL %s: %s\n", case_name, what);
}

void end(void) {
  if (!case_failed)
    printf("ok   %s\n", case_name);
}

static unsigned long long seed = 1;
float uniform(void) {
  seed = seed * 6364136223846793005ull + 1442695040888963407ull;
  return (float)(seed >> 40) / 16777216.0f;
}

ball new_ball(float radius) {
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
void noise(uint16_t texels[SIDE * SIDE]) {
  enum { BELT = SIDE / BELTS + 1 };
  for (int i = 0; i < SIDE * SIDE; i++)
    texels[i] = i < SIDE * BELT || i >= SIDE * (SIDE - BELT) ? 0 : (uint16_t)(65535 * uniform());
}

prismarch_map *new_map(void) {
  uint16_t texels[SIDE * SIDE];
  noise(texels);
  const prismarch_texels t = {texels, PRISMARCH_TEXEL_U16, 0, 0};
  prismarch_map *map = NULL;
  prismarch_error error;
  if (prismarch_map_create(SIDE, SIDE, &t, PRISMARCH_WRAP_REPEAT, &map, &error))
    printf("FAIL map: %s\n", error.message), exit(1);
  return map;
}

prismarch_surface_desc desc_of(const ball *b, prismarch_map *map) {
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

prismarch_surface *surface_of(const prismarch_surface_desc *desc) {
  prismarch_surface *surface = NULL;
  prismarch_error error;
  if (prismarch_surface_create(desc, &surface, &error))
    printf("FAIL surface: %s\n", error.message), exit(1);
  return surface;
}

RTCGeometry geometry_of(RTCDevice device, prismarch_surface *surface) {
  RTCGeometry geometry = NULL;
  prismarch_error error;
  if (prismarch_geometry_create(device, surface, &geometry, &error))
    printf("FAIL geometry: %s\n", error.message), exit(1);
  rtcSetGeometryMask(geometry, 0xffffffffu);
  return geometry;
}

world new_world(enum RTCSceneFlags flags) {
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

void free_world(world *w) {
  rtcReleaseGeometry(w->geometry);
  rtcReleaseScene(w->scene);
  prismarch_surface_release(w->surface);
  prismarch_map_release(w->map);
  rtcReleaseDevice(w->device);
}

struct RTCRayHit random_ray(void) {
  float o[3], d[3];
  for (int k = 0; k < 3; k++) {
    o[k] = 4 * uniform() - 2;
    d[k] = (uniform() - 0.5f) - 0.5f * o[k];
  }
  return ray_at(o, d);
}

int is_hit(const struct RTCRayHit *q) { return q->hit.geomID != RTC_INVALID_GEOMETRY_ID; }

RTCGeometry instance_of(RTCDevice device, RTCScene scene, float x) {
  const float transform[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, x, 0, 0};
  RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, scene);
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform);
  rtcSetGeometryMask(instance, 0xffffffffu);
  rtcCommitGeometry(instance);
  return instance;
}
