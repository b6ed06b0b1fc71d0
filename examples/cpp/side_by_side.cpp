// One program, two ways to displace a torus: as a mesh of a vertex per texel, and by prismarch.
//
//     side_by_side --tessellated OUT.pgm | --prismarch OUT.pgm | --compare
//
// --compare renders both and fails where they differ by more than 2 %: the mesh has facets.
#include "program.hpp"

namespace {

constexpr int SIZE = 384, RING = 24, TUBE = 12;
constexpr float SCALE = 0.12f;

struct Torus {
  std::vector<Vec> positions, normals;
  std::vector<float> texcoords;
  std::vector<uint32_t> quads;

  Torus() {
    for (int j = 0; j <= TUBE; j++)
      for (int i = 0; i <= RING; i++) {
        const float s = float(i) / RING, t = float(j) / TUBE;
        // The last row and column are the first ones, to the bit: the seam of the texture coordinates does not open.
        const float a = 6.2831853f * (i % RING) / RING, b = 6.2831853f * (j % TUBE) / TUBE;
        const Vec n = {std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), std::sin(b)};
        positions.push_back(Vec{std::cos(a), std::sin(a), 0} + 0.4f * n);
        normals.push_back(n);
        texcoords.insert(texcoords.end(), {s, t});
      }
    for (uint32_t j = 0; j < TUBE; j++)
      for (uint32_t i = 0; i < RING; i++) {
        const uint32_t v = j * (RING + 1) + i;
        quads.insert(quads.end(), {v, v + 1, v + RING + 2, v + RING + 1});
      }
  }
};

// Both triangles of every quad, cut into `n` parts a side.
RTCGeometry tessellated(RTCDevice device, const Torus &torus, const Map &map, unsigned n) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  const size_t faces = torus.quads.size() / 2, per_face = size_t(n + 1) * (n + 2) / 2;
  auto *v = static_cast<Vec *>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec),
                                                       faces * per_face));
  auto *f = static_cast<uint32_t *>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, faces * n * n));
  uint32_t base = 0;
  for (size_t face = 0; face < faces; face++) {
    const uint32_t *q = &torus.quads[face / 2 * 4];
    const uint32_t corner[3] = {face % 2 ? q[2] : q[0], face % 2 ? q[3] : q[1], face % 2 ? q[1] : q[3]};
    const auto row = [&](unsigned j) { return base + j * (n + 1) - j * (j - 1) / 2; };
    for (unsigned j = 0; j <= n; j++)
      for (unsigned i = 0; i + j <= n; i++) {
        const float b[3] = {float(n - i - j) / n, float(i) / n, float(j) / n};
        Vec p = {0, 0, 0}, m = {0, 0, 0};
        float s = 0, t = 0;
        for (int k = 0; k < 3; k++) {
          p = p + b[k] * torus.positions[corner[k]];
          m = m + b[k] * torus.normals[corner[k]];
          s += b[k] * torus.texcoords[2 * corner[k]];
          t += b[k] * torus.texcoords[2 * corner[k] + 1];
        }
        v[row(j) + i] = p + SCALE * map.height(s, t) * normalize(m);
        const auto triangle = [&](uint32_t a, uint32_t b, uint32_t c) { *f++ = a, *f++ = b, *f++ = c; };
        if (i + j < n)
          triangle(row(j) + i, row(j) + i + 1, row(j + 1) + i);
        if (i + j + 1 < n)
          triangle(row(j) + i + 1, row(j + 1) + i + 1, row(j + 1) + i);
      }
    base += uint32_t(per_face);
  }
  return geometry;
}

RTCGeometry displaced(RTCDevice device, const Torus &torus, const Map &map, size_t *bytes) {
  prismarch_surface_desc desc;
  prismarch_surface_desc_init(&desc);
  desc.vertex_count = uint32_t(torus.positions.size());
  desc.primitive_count = uint32_t(torus.quads.size() / 4);
  desc.primitive = PRISMARCH_QUADS;
  desc.indices.data = torus.quads.data();
  desc.vertices.positions.data = torus.positions.data();
  desc.vertices.normals.data = torus.normals.data();
  desc.texcoords.data = torus.texcoords.data();
  desc.map = map.create();
  desc.scale = SCALE;
  desc.has_filter = false;
  return geometry_of(device, desc, bytes);
}

std::vector<float> picture_of(bool by_prismarch) {
  const Map map(512);
  const Torus torus;
  RTCDevice device = new_device();
  const double start = seconds();
  size_t own = 0;
  RTCGeometry geometry = by_prismarch ? displaced(device, torus, map, &own) : tessellated(device, torus, map, 43);
  RTCScene scene = scene_of(device, geometry);
  const double built = seconds();
  std::vector<float> picture = render(scene, SIZE, {2.2f, -2.9f, 2.2f}, {0, 0, -0.1f});
  std::printf("%-12s built in %.3f s, %.2f MB beside the map, rendered in %.3f s\n",
              by_prismarch ? "prismarch" : "tessellated", built - start, double(embree_bytes + (long long)own) / 1e6,
              seconds() - built);
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return picture;
}

} // namespace

int main(int argc, char **argv) {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (mode == "--compare" && argc == 2) {
    const double apart = difference(picture_of(false), picture_of(true));
    std::printf("mean difference of the pictures: %.3f %%\n", 100 * apart);
    return apart < 0.02 ? 0 : 1;
  }
  if ((mode == "--tessellated" || mode == "--prismarch") && argc == 3) {
    if (write_pgm(argv[2], picture_of(mode == "--prismarch"), SIZE))
      return 0;
    std::fprintf(stderr, "cannot write %s\n", argv[2]);
    return 4;
  }
  std::fprintf(stderr, "usage: side_by_side --tessellated OUT.pgm | --prismarch OUT.pgm | --compare\n");
  return 2;
}
