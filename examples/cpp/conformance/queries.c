/* Points and maps: the nearest ones, and maps from files. */
#define _POSIX_C_SOURCE 200809L
#include "ball.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

void closest(void) {
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

void uncommitted(void) {
  begin("prismarch_closest of a scene that is not committed: a status");
  world w = new_world(RTC_SCENE_FLAG_NONE);
  RTCScene scene = rtcNewScene(w.device);
  const float position[3] = {3, 0, 0};
  bool found;
  prismarch_closest_point p;
  prismarch_error e;
  EXPECT(prismarch_closest(NULL, position, 10, 0, &found, &p, &e) == PRISMARCH_ERROR_NULL);
  EXPECT(prismarch_closest(scene, position, 10, 0, &found, &p, &e) == PRISMARCH_ERROR_EMBREE && *e.message);
  const unsigned id = rtcAttachGeometry(scene, w.geometry);
  EXPECT(prismarch_closest(scene, position, 10, 0, &found, &p, &e) == PRISMARCH_ERROR_EMBREE);
  rtcCommitScene(scene);
  EXPECT(prismarch_closest(scene, position, 10, 0, &found, &p, &e) == PRISMARCH_OK && found);
  /* Changed since. */
  rtcDetachGeometry(scene, id);
  EXPECT(prismarch_closest(scene, position, 10, 0, &found, &p, &e) == PRISMARCH_ERROR_EMBREE);
  rtcCommitScene(scene);
  EXPECT(prismarch_closest(scene, position, 10, 0, &found, &p, &e) == PRISMARCH_OK && !found);
  rtcReleaseScene(scene);
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

void point_queries(void) {
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

void files(void) {
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
