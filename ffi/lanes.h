/* Rays and hits as Embree hands them over: N lanes of 4-byte words, word-major; for N = 1 that is the plain struct. Private. */
#ifndef PRISMARCH_LANES_H
#define PRISMARCH_LANES_H

#include "embree.h"

#include <stddef.h>
#include <string.h>

enum {
  RAY_WORDS = sizeof(struct RTCRay) / 4,
#ifdef RTC_GEOMETRY_INSTANCE_ARRAY
  HIT_WORDS = 7 + 2 * RTC_MAX_INSTANCE_LEVEL_COUNT,
#else
  HIT_WORDS = 7 + RTC_MAX_INSTANCE_LEVEL_COUNT,
#endif
  TFAR_WORD = offsetof(struct RTCRay, tfar) / 4
};
_Static_assert(sizeof(struct RTCHit) >= 4 * HIT_WORDS && offsetof(struct RTCHit, instID) == 4 * 7, "RTCHit");

static inline void load_words(void *out, const void *lanes, unsigned words, unsigned n, unsigned i) {
  if (n == 1) {
    memcpy(out, lanes, 4 * (size_t)words);
    return;
  }
  for (unsigned w = 0; w < words; w++)
    memcpy((char *)out + 4 * w, (const char *)lanes + 4 * ((size_t)w * n + i), 4);
}

static inline void store_words(void *lanes, const void *in, unsigned words, unsigned n, unsigned i) {
  if (n == 1) {
    memcpy(lanes, in, 4 * (size_t)words);
    return;
  }
  for (unsigned w = 0; w < words; w++)
    memcpy((char *)lanes + 4 * ((size_t)w * n + i), (const char *)in + 4 * w, 4);
}

static inline void store_tfar(void *lanes, float tfar, unsigned n, unsigned i) {
  memcpy((char *)lanes + 4 * ((size_t)TFAR_WORD * n + i), &tfar, 4);
}

static inline void unpack_hit(pm_scene_hit *out, float t, const struct RTCHit *hit) {
  out->at.t = t;
  out->at.u = hit->u;
  out->at.v = hit->v;
  out->at.ng[0] = hit->Ng_x;
  out->at.ng[1] = hit->Ng_y;
  out->at.ng[2] = hit->Ng_z;
  out->at.prim = hit->primID;
  out->geom = hit->geomID;
  for (unsigned l = 0; l < PM_INSTANCE_LEVELS; l++)
    out->inst[l] = hit->instID[l];
}

#endif
