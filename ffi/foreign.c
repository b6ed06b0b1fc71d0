/* Geometries on a caller's own device, and how their end is noticed.
 *
 * A geometry of Embree's has no destructor that a caller could set, and a caller that releases geometries by Embree's own rules
 * tells no one. But it is a C++ object with a virtual destructor: the geometry is given a copy of its own table of virtual functions, in
 * which the deleting destructor is ours; that calls Embree's, then lets go of what the geometry kept. This holds for the
 * Itanium C++ ABI (all compilers on Linux, macOS, BSD), where the table of a class whose first virtual function is its destructor begins
 * with the complete and the deleting destructor, as Embree 3's and 4's reference counted objects do. Whether it holds for the Embree
 * at hand is tried on a geometry of its own every time, before a caller's is touched; where it does not hold, what a geometry kept
 * stays until the process ends. */
#define _GNU_SOURCE
#include "embree.h"

#include <link.h>
#include <stdlib.h>
#include <string.h>

typedef void (*virtual_function)(void *self);

enum {
  TABLE_HEAD = 2,    /* offset to top and type information, before the functions */
  MOST_SLOTS = 512, /* far more than any geometry has */
  DELETING_DESTRUCTOR = 1
};

/* What follows a geometry through its life. */
typedef struct watch {
  const virtual_function *original;
  void (*gone)(void *user);
  void *user;
  virtual_function table[]; /* with its head */
} watch;

static const virtual_function *table_of(const void *object) {
  const virtual_function *table;
  memcpy(&table, object, sizeof table);
  return table;
}

static void destroy(void *object) {
  watch *w = (watch *)((char *)(table_of(object) - TABLE_HEAD) - offsetof(watch, table));
  w->original[DELETING_DESTRUCTOR](object);
  w->gone(w->user);
  free(w);
}

/* How far the memory goes on that a table lies in. */
typedef struct extent {
  uintptr_t at, end;
} extent;

static int in_object(struct dl_phdr_info *info, size_t size, void *data) {
  (void)size;
  extent *e = data;
  for (unsigned i = 0; i < info->dlpi_phnum; i++) {
    const uintptr_t from = info->dlpi_addr + info->dlpi_phdr[i].p_vaddr;
    const uintptr_t to = from + info->dlpi_phdr[i].p_memsz;
    if (info->dlpi_phdr[i].p_type == PT_LOAD && e->at >= from && e->at < to) {
      e->end = to;
      return 1;
    }
  }
  return 0;
}

/* Calls gone(user) when Embree destroys the geometry; false where that cannot be arranged. */
static bool watch_end(RTCGeometry geometry, void (*gone)(void *user), void *user) {
  const virtual_function *original = table_of(geometry);
  extent e = {(uintptr_t)original, 0};
  if (!dl_iterate_phdr(in_object, &e))
    return false;
  size_t slots = (e.end - e.at) / sizeof *original;
  if (slots > MOST_SLOTS)
    slots = MOST_SLOTS;
  watch *w = malloc(sizeof *w + (TABLE_HEAD + slots) * sizeof *w->table);
  if (!w)
    return false;
  *w = (watch){original, gone, user};
  memcpy(w->table, original - TABLE_HEAD, (TABLE_HEAD + slots) * sizeof *w->table);
  virtual_function *table = w->table + TABLE_HEAD;
  table[DELETING_DESTRUCTOR] = destroy;
  memcpy(geometry, &table, sizeof table);
  return true;
}

static void count(void *user) { ++*(unsigned *)user; }

/* Whether a geometry's end is noticed, once, and nothing before it is taken for one. */
static bool can_watch(RTCDevice device) {
  unsigned ends = 0;
  RTCGeometry tried = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  if (!tried || !watch_end(tried, count, &ends)) {
    if (tried)
      rtcReleaseGeometry(tried);
    return false;
  }
  rtcRetainGeometry(tried);
  rtcReleaseGeometry(tried);
  const bool is_early = ends != 0;
  if (!is_early)
    rtcReleaseGeometry(tried);
  return !is_early && ends == 1;
}

uint32_t pm_foreign_major(void *device) {
  return (uint32_t)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION) / 10000;
}

typedef struct foreign {
  pm_geometry geometry;
  void (*gone)(void *user);
  void *user;
} foreign;

static void end(void *user) {
  foreign *f = user;
  f->gone(f->user);
  free(f);
}

void *pm_foreign_new(void *device, const pm_hit_test *test, void *user, uint32_t primitives, uint32_t time_steps,
                     void (*gone)(void *user)) {
  foreign *f = calloc(1, sizeof *f);
  if (!f)
    return NULL;
  const bool can = can_watch(device);
  RTCGeometry rtc = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  if (!rtc) {
    free(f);
    return NULL;
  }
  *f = (foreign){{.rtc = rtc, .is_foreign = true}, gone, user};
  rtcSetGeometryUserData(rtc, &f->geometry);
  pm_geometry_set_test(&f->geometry, test, user, primitives, time_steps);
  /* Embree 4's default is bit 0 alone, as of all its geometries: the caller knows. */
  pm_set_callbacks(rtc);
  if (can)
    watch_end(rtc, end, f);
  return rtc;
}

void pm_foreign_release(void *geometry) { rtcReleaseGeometry(geometry); }

uint32_t pm_foreign_attach(void *scene, void *geometry) {
  rtcCommitGeometry(geometry);
  return rtcAttachGeometry(scene, geometry);
}

void pm_foreign_set_caller_data(void *geometry, void *data) {
  pm_geometry *g = rtcGetGeometryUserData(geometry);
  g->caller_data = data;
}

void *pm_foreign_caller_data(void *geometry) {
  const pm_geometry *g = rtcGetGeometryUserData(geometry);
  return g->caller_data;
}
