/* Geometries on a caller's own device, and how their end is noticed.
 *
 * A geometry of Embree's has no destructor that a caller could set, and a caller that releases geometries by Embree's own rules
 * tells no one. But it is a C++ object with a virtual destructor: the geometry is given a copy of its own table of virtual functions, in
 * which the deleting destructor is ours; that calls Embree's, then lets go of what the geometry kept. This holds for the
 * Itanium C++ ABI, where the table of a class whose first virtual function is its destructor begins
 * with the complete and the deleting destructor, as Embree 3's and 4's reference counted objects do. Whether it holds for the Embree
 * at hand is tried on a geometry of its own every time, before a caller's is touched; where it does not hold, geometries are not watched.
 *
 * How far a table may be read is asked of glibc's loader. With another C library or object format (or PM_NO_WATCH) nothing is watched, and
 * nobody looks into Embree's objects: there the callers of pm_foreign_new keep what a geometry needs. */
#define _GNU_SOURCE
#include "embree.h"

#include <stdlib.h>
#include <string.h>

#if defined(__GLIBC__) && defined(__ELF__) && !defined(PM_NO_WATCH)
#define WATCHES 1
#include <link.h>
#else
#define WATCHES 0
#endif

struct pm_foreign {
  pm_geometry geometry;
  bool is_watched;
  void (*ending)(const void *geometry);
  void (*gone)(void *user);
  void *user;
};

bool pm_foreign_can_watch(void) { return WATCHES; }

#if WATCHES
typedef void (*virtual_function)(void *self);

enum {
  TABLE_HEAD = 2,    /* offset to top and type information, before the functions */
  MOST_SLOTS = 512, /* far more than any geometry has */
  DELETING_DESTRUCTOR = 1
};

/* What follows a geometry through its life. */
typedef struct watch {
  const virtual_function *original;
  void (*ending)(const void *geometry, void *user);
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
  /* First: what is freed may be another geometry's memory at once. */
  w->ending(object, w->user);
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

/* Tells of the geometry's end, before and after; false where that cannot be arranged. */
static bool watch_end(RTCGeometry geometry, void (*ending)(const void *geometry, void *user), void (*gone)(void *user),
                      void *user) {
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
  *w = (watch){original, ending, gone, user};
  memcpy(w->table, original - TABLE_HEAD, (TABLE_HEAD + slots) * sizeof *w->table);
  virtual_function *table = w->table + TABLE_HEAD;
  table[DELETING_DESTRUCTOR] = destroy;
  memcpy(geometry, &table, sizeof table);
  return true;
}

static void ignore(const void *geometry, void *user) {
  (void)geometry;
  (void)user;
}

static void count(void *user) { ++*(unsigned *)user; }

/* Whether a geometry's end is noticed, once, and nothing before it is taken for one. */
static bool can_watch(RTCDevice device) {
  unsigned ends = 0;
  RTCGeometry tried = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  if (!tried || !watch_end(tried, ignore, count, &ends)) {
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

static void begin_end(const void *geometry, void *user) { ((pm_foreign *)user)->ending(geometry); }

static void end(void *user) { pm_foreign_free(user); }

static bool watched(pm_foreign *foreign, RTCDevice device) {
  return can_watch(device) && watch_end(foreign->geometry.rtc, begin_end, end, foreign);
}
#else
static bool watched(pm_foreign *foreign, RTCDevice device) {
  (void)foreign;
  (void)device;
  return false;
}
#endif

uint32_t pm_foreign_major(void *device) {
  return (uint32_t)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION) / 10000;
}

pm_foreign *pm_foreign_new(void *device, const pm_hit_test *test, void *user, uint32_t primitives, uint32_t time_steps,
                           bool has_filter, void (*ending)(const void *geometry), void (*gone)(void *user)) {
  pm_foreign *f = calloc(1, sizeof *f);
  if (!f)
    return NULL;
  RTCGeometry rtc = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  if (!rtc) {
    free(f);
    return NULL;
  }
  f->geometry.rtc = rtc;
  f->geometry.is_foreign = true;
  f->geometry.may_be_filtered = has_filter;
  f->ending = ending;
  f->gone = gone;
  f->user = user;
  rtcSetGeometryUserData(rtc, &f->geometry);
  pm_geometry_set_test(&f->geometry, test, user, primitives, time_steps);
  /* Embree 4's default mask is bit 0 alone, as of all its geometries: the caller knows. */
  pm_set_callbacks(rtc);
  f->is_watched = watched(f, device);
  return f;
}

void *pm_foreign_geometry(const pm_foreign *foreign) { return foreign->geometry.rtc; }

bool pm_foreign_is_watched(const pm_foreign *foreign) { return foreign->is_watched; }

void pm_foreign_free(pm_foreign *foreign) {
  foreign->gone(foreign->user);
  free(foreign);
}

void pm_foreign_set_caller_data(pm_foreign *foreign, void *data) {
  atomic_store_explicit(&foreign->geometry.caller_data, data, memory_order_relaxed);
}

void *pm_foreign_caller_data(const pm_foreign *foreign) {
  return atomic_load_explicit(&foreign->geometry.caller_data, memory_order_relaxed);
}

void pm_foreign_release(void *geometry) { rtcReleaseGeometry(geometry); }

uint32_t pm_foreign_attach(void *scene, void *geometry) {
  rtcCommitGeometry(geometry);
  return rtcAttachGeometry(scene, geometry);
}
