/* Embree's headers, and what the files of this directory share; private to them. */
#ifndef PRISMARCH_EMBREE_H
#define PRISMARCH_EMBREE_H

#include "shim.h"

#include <stdatomic.h>

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
  bool is_foreign;     /* on a caller's device: filters get `caller_data` */
  bool may_be_filtered; /* filters may be set behind our back */
  _Atomic(void *) caller_data;
};

/* The bounds, intersect, occluded and point query functions of a user geometry whose user data is a pm_geometry. */
void pm_set_callbacks(RTCGeometry geometry);
void pm_on_filter(const struct RTCFilterFunctionNArguments *args);
/* Has nothing to say but in pm_closest1 and pm_closest_in. */
bool pm_on_point_query(struct RTCPointQueryFunctionArguments *args);

#endif
