// A pattern that renderers have today, a subdivision geometry with a displacement function, and prismarch in its place: pictures,
// memory and time side by side. Fails where the pictures differ by more than 2 %: the mesh has facets, of a vertex per texel.
#include "program.hpp"

namespace {

constexpr int SIZE = 384, CELLS = 16, TEXELS = 1024;
constexpr float SCALE = 0.15f;

// A square of CELLS x CELLS quads.
struct Ground {
  std::vector<Vec> positions;
  std::vector<float> texcoords;
  std::vector<uint32_t> quads, sides;

  Ground() {
    for (int j = 0; j <= CELLS; j++)
      for (int i = 0; i <= CELLS; i++) {
        const float s = float(i) / CELLS, t = float(j) / CELLS;
        positions.push_back({2 * s - 1, 2 * t - 1, 0});
        texcoords.insert(texcoords.end(), {s, t});
      }
    for (uint32_t j = 0; j < CELLS; j++)
      for (uint32_t i = 0; i < CELLS; i++) {
        const uint32_t v = j * (CELLS + 1) + i;
        quads.insert(quads.end(), {v, v + 1, v + CELLS + 2, v + CELLS + 1});
        sides.push_back(4);
      }
  }
};

void displace(const RTCDisplacementFunctionNArguments *args) {
  const Map &map = *static_cast<const Map *>(args->geometryUserPtr);
  const unsigned i = args->primID % CELLS, j = args->primID / CELLS;
  for (unsigned k = 0; k < args->N; k++) {
    const float d = SCALE * map.height((i + args->u[k]) / CELLS, (j + args->v[k]) / CELLS);
    args->P_x[k] += d * args->Ng_x[k];
    args->P_y[k] += d * args->Ng_y[k];
    args->P_z[k] += d * args->Ng_z[k];
  }
}

RTCGeometry subdivided(RTCDevice device, const Ground &ground, const Map &map) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SUBDIVISION);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, ground.positions.data(), 0, sizeof(Vec),
                             ground.positions.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, ground.quads.data(), 0, 4,
                             ground.quads.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_FACE, 0, RTC_FORMAT_UINT, ground.sides.data(), 0, 4,
                             ground.sides.size());
  // The flat base mesh itself, a vertex per texel.
  rtcSetGeometrySubdivisionMode(geometry, 0, RTC_SUBDIVISION_MODE_PIN_ALL);
  rtcSetGeometryTessellationRate(geometry, float(TEXELS / CELLS));
  rtcSetGeometryUserData(geometry, const_cast<Map *>(&map));
  rtcSetGeometryDisplacementFunction(geometry, displace);
  return geometry;
}

RTCGeometry by_prismarch(RTCDevice device, const Ground &ground, const Map &map, size_t *bytes) {
  const std::vector<Vec> normals(ground.positions.size(), Vec{0, 0, 1});
  prismarch_surface_desc desc;
  prismarch_surface_desc_init(&desc);
  desc.vertex_count = uint32_t(ground.positions.size());
  desc.primitive_count = uint32_t(ground.sides.size());
  desc.primitive = PRISMARCH_QUADS;
  desc.indices.data = ground.quads.data();
  desc.vertices.positions.data = ground.positions.data();
  desc.vertices.normals.data = normals.data();
  desc.texcoords.data = ground.texcoords.data();
  desc.map = map.create();
  desc.scale = SCALE;
  desc.has_filter = false;
  return geometry_of(device, desc, bytes);
}

} // namespace

int main() {
  const Map map(TEXELS);
  const Ground ground;
  std::vector<float> pictures[2];
  std::printf("| | build, s | memory beside the map, MB | picture, s |\n| --- | --- | --- | --- |\n");
  for (int k = 0; k < 2; k++) {
    RTCDevice device = new_device();
    const double start = seconds();
    size_t own = 0;
    RTCGeometry geometry = k == 0 ? subdivided(device, ground, map) : by_prismarch(device, ground, map, &own);
    RTCScene scene = scene_of(device, geometry);
    const double built = seconds();
    pictures[k] = render(scene, SIZE, {1.2f, -1.6f, 1.2f}, {0, 0, 0.05f});
    std::printf("| %s | %.3f | %.2f | %.3f |\n", k == 0 ? "subdivision, displacement function" : "prismarch", built - start,
                double(embree_bytes + (long long)own) / 1e6, seconds() - built);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  const double apart = difference(pictures[0], pictures[1]);
  std::printf("\nmean difference of the pictures: %.3f %%\n", 100 * apart);
  return apart < 0.02 ? 0 : 1;
}
