/* Whether a surface behaves as Embree's own geometries do: one line per case, exit code 1 where one fails. */
#include "ball.h"

#include <stdio.h>

int main(void) {
  setvbuf(stdout, NULL, _IOLBF, 0);
  printf("prismarch %u, Embree %u\n", prismarch_version(), prismarch_embree_version());
  bounds();
  interpolation();
  interval();
  masks();
  filters();
  packets4();
  packets8();
  packets16();
#if EMBREE_MAJOR == 3
  pointers();
#endif
  unfiltered();
  instances();
  odd_rays();
  watertight();
  edits();
  motion();
  closest();
  uncommitted();
  point_queries();
  files();
  lifetimes();
  threads();
  updates_beside_rays();
  handles_beside_releases();
  memory();
  misuse();
  handles();
  geometries();
  descriptions();
  counts();
  limits();
  printf("%d of the cases failed\n", failures);
  return failures != 0;
}
