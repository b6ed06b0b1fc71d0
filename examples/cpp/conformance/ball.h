/* A displaced ball in a scene, and cases that say whether they hold. */
#ifndef CONFORMANCE_BALL_H
#define CONFORMANCE_BALL_H

#include "../embree.h"

/* Cases that have failed. */
extern int failures;

/* One case: its name, what it expects, and its line. */
void begin(const char *name);
void expect(int holds, const char *what);
void end(void);
#define EXPECT(what) expect((what) ? 1 : 0, #what)

/* A sphere of radius 1 of RING x BELTS quads, displaced by 0 to 0.1 of noise. */
enum { RING = 16, BELTS = 8, VERTICES = (RING + 1) * (BELTS + 1), QUADS = RING * BELTS, SIDE = 64 };
static const float SCALE = 0.1f;

typedef struct ball {
  float positions[VERTICES][3], normals[VERTICES][3], texcoords[VERTICES][2];
  uint32_t quads[QUADS][4];
} ball;

/* A device with one ball in one scene. */
typedef struct world {
  RTCDevice device;
  RTCScene scene;
  RTCGeometry geometry;
  prismarch_surface *surface;
  prismarch_map *map;
} world;

float uniform(void);
ball new_ball(float radius);
void noise(uint16_t texels[SIDE * SIDE]);
prismarch_map *new_map(void);
prismarch_surface_desc desc_of(const ball *b, prismarch_map *map);
prismarch_surface *surface_of(const prismarch_surface_desc *desc);
RTCGeometry geometry_of(RTCDevice device, prismarch_surface *surface);
world new_world(enum RTCSceneFlags flags);
void free_world(world *w);
struct RTCRayHit random_ray(void);
int is_hit(const struct RTCRayHit *q);
RTCGeometry instance_of(RTCDevice device, RTCScene scene, float x);

/* The cases. In rays.c: */
void bounds(void);
void interpolation(void);
void interval(void);
void masks(void);
void filters(void);
void packets4(void);
void packets8(void);
void packets16(void);
#if EMBREE_MAJOR == 3
void pointers(void);
#endif
void unfiltered(void);
void instances(void);
void odd_rays(void);
void watertight(void);
/* In changes.c: */
void edits(void);
void motion(void);
void lifetimes(void);
void threads(void);
void updates_beside_rays(void);
void handles_beside_releases(void);
void memory(void);
/* In queries.c: */
void closest(void);
void uncommitted(void);
void point_queries(void);
void files(void);
/* In misuse.c: */
void misuse(void);
void handles(void);
void geometries(void);
void descriptions(void);
void counts(void);
void limits(void);

#endif
