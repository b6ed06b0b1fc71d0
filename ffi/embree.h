/* Embree's headers, and what the files of this directory share; private to them. */
#ifndef PRISMARCH_EMBREE_H
#define PRISMARCH_EMBREE_H

#include "shim.h"

#if PM_EMBREE_MAJOR == 3
#include <embree3/rtcore.h>
typedef struct RTCIntersectContext query_context;
#elif PM_EMBREE_MAJOR == 4
#include <embree4/rtcore.h>
typedef struct RTCRayQueryContext query_context;
#else
#error "PM_EMBREE_MAJOR must be 3 or 4"
#endif

struct pm_geometry {
  RTCGeometry rtc;
  pm_hit_test test;
  const void *test_user;
  pm_filter filter; /* NULL: none */
  const void *filter_user;
  pm_scene *instanced; /* NULL: no instance */
};

/* The callback of user geometries in pm_closest1. */
bool pm_on_point_query(struct RTCPointQueryFunctionArguments *args);

#endif
