/* What a caller must not do: a status and a text, never a crash. */
#include "ball.h"

#include <math.h>
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
