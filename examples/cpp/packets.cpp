// Packets of eight through filters and instances of instances: a ring of displaced tiles with holes cut by a filter, traced in packets (with
// Embree 3 in streams, too) and ray by ray. Prints what was traced; exit code 1 where one hit differs.
#include "program.hpp"

namespace {

// What the filters are asked for, and how often they said no. Both filters may run on many threads.
struct Holes {
  float radius;
  std::atomic<long> rejected{0};
};

// Cuts a disk out of every quad: what is within `radius` of its middle is not hit.
void cut_out(const RTCFilterFunctionNArguments *args) {
  auto &holes = *static_cast<Holes *>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; i++) {
    if (args->valid[i] != -1)
      continue;
    const float u = RTCHitN_u(args->hit, args->N, i) - 0.5f, v = RTCHitN_v(args->hit, args->N, i) - 0.5f;
    if (u * u + v * v < holes.radius * holes.radius) {
      args->valid[i] = 0;
      holes.rejected++;
    }
  }
}

// A wavy tile of 6 x 6 quads under a map.
RTCGeometry tile(RTCDevice device, Holes &holes) {
  constexpr int n = 6;
  std::vector<float> positions, texcoords;
  std::vector<uint32_t> quads;
  for (int j = 0; j <= n; j++)
    for (int i = 0; i <= n; i++) {
      const float x = 2.0f * i / n - 1, y = 2.0f * j / n - 1;
      for (float p : {x, y, 0.15f * std::sin(3 * x) * std::cos(2 * y)})
        positions.push_back(p);
      for (float t : {float(i) / n, float(j) / n})
        texcoords.push_back(t);
    }
  for (uint32_t j = 0; j < n; j++)
    for (uint32_t i = 0; i < n; i++) {
      const uint32_t v = j * (n + 1) + i;
      for (uint32_t corner : {v, v + 1, v + n + 2, v + n + 1})
        quads.push_back(corner);
    }
  prismarch_surface_desc desc;
  prismarch_surface_desc_init(&desc);
  desc.vertex_count = uint32_t(positions.size() / 3);
  desc.primitive_count = uint32_t(quads.size() / 4);
  desc.primitive = PRISMARCH_QUADS;
  desc.indices.data = quads.data();
  desc.vertices.positions.data = positions.data();
  desc.texcoords.data = texcoords.data();
  desc.map = Map(256).create();
  desc.scale = 0.2f;
  size_t bytes;
  RTCGeometry geometry = geometry_of(device, desc, &bytes);
  prismarch_error error;
  check(prismarch_geometry_set_user_data(geometry, &holes, &error), error);
  rtcSetGeometryIntersectFilterFunction(geometry, cut_out);
  rtcSetGeometryOccludedFilterFunction(geometry, cut_out);
  return geometry;
}

// A scene of `count` instances of another, turned about the z axis and moved outward.
RTCScene ring(RTCDevice device, RTCScene of, int count, float radius, float scale) {
  RTCScene scene = rtcNewScene(device);
  for (int k = 0; k < count; k++) {
    const float a = 6.2831853f * k / count, c = scale * std::cos(a), s = scale * std::sin(a);
    const float transform[12] = {c, s, 0, -s, c, 0, 0, 0, scale, radius * std::cos(a), radius * std::sin(a), 0.1f * k};
    RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, of);
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform);
    rtcSetGeometryMask(instance, 0xffffffffu);
    rtcCommitGeometry(instance);
    rtcAttachGeometry(scene, instance);
    rtcReleaseGeometry(instance);
  }
  rtcCommitScene(scene);
  return scene;
}

constexpr int lanes = 8;

void set_ray(RTCRay8 &packet, int lane, const RTCRay &ray) {
  packet.org_x[lane] = ray.org_x, packet.org_y[lane] = ray.org_y, packet.org_z[lane] = ray.org_z;
  packet.dir_x[lane] = ray.dir_x, packet.dir_y[lane] = ray.dir_y, packet.dir_z[lane] = ray.dir_z;
  packet.tnear[lane] = ray.tnear, packet.tfar[lane] = ray.tfar, packet.mask[lane] = ray.mask;
  packet.time[lane] = 0, packet.id[lane] = 0, packet.flags[lane] = 0;
}

void intersect8(const int *valid, RTCScene scene, RTCRayHit8 &packet) {
#if EMBREE_MAJOR == 3
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &context, &packet);
#else
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &packet, &arguments);
#endif
}

void occluded8(const int *valid, RTCScene scene, RTCRay8 &packet) {
#if EMBREE_MAJOR == 3
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &context, &packet);
#else
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &packet, &arguments);
#endif
}

bool is_hit(const RTCHit &hit) { return hit.geomID != RTC_INVALID_GEOMETRY_ID; }

#if EMBREE_MAJOR == 3
// Embree 3 takes streams, too: of single rays, and of packets of any size. How many lanes are unlike their single rays.
long streams(RTCScene scene, const std::vector<RTCRayHit> &traced, const std::vector<RTCRayHit> &rays) {
  constexpr unsigned n = 5, ray_words = sizeof(RTCRay) / 4, words = sizeof(RTCRayHit) / 4;
  const unsigned m = unsigned(rays.size()) / n;
  std::vector<float> packets(size_t(m) * n * words), shadows(size_t(m) * n * ray_words);
  auto packet = [&](unsigned i) { return reinterpret_cast<RTCRayHitN *>(&packets[size_t(i / n) * n * words]); };
  auto shadow = [&](unsigned i) { return reinterpret_cast<RTCRayN *>(&shadows[size_t(i / n) * n * ray_words]); };
  for (unsigned i = 0; i < m * n; i++) {
    const RTCRay &r = rays[i].ray;
    for (RTCRayN *to : {RTCRayHitN_RayN(packet(i), n), shadow(i)}) {
      RTCRayN_org_x(to, n, i % n) = r.org_x, RTCRayN_org_y(to, n, i % n) = r.org_y, RTCRayN_org_z(to, n, i % n) = r.org_z;
      RTCRayN_dir_x(to, n, i % n) = r.dir_x, RTCRayN_dir_y(to, n, i % n) = r.dir_y, RTCRayN_dir_z(to, n, i % n) = r.dir_z;
      RTCRayN_tfar(to, n, i % n) = r.tfar, RTCRayN_mask(to, n, i % n) = r.mask;
    }
    RTCHitN_geomID(RTCRayHitN_HitN(packet(i), n), n, i % n) = RTC_INVALID_GEOMETRY_ID;
  }
  std::vector<RTCRayHit> stream = rays;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersectNM(scene, &context, packet(0), n, m, sizeof(float) * n * words);
  rtcOccludedNM(scene, &context, shadow(0), n, m, sizeof(float) * n * ray_words);
  rtcIntersect1M(scene, &context, stream.data(), unsigned(stream.size()), sizeof(RTCRayHit));
  long differ = 0;
  for (unsigned i = 0; i < m * n; i++) {
    const RTCRayHit &single = traced[i];
    differ += RTCHitN_geomID(RTCRayHitN_HitN(packet(i), n), n, i % n) != single.hit.geomID ||
              RTCRayN_tfar(RTCRayHitN_RayN(packet(i), n), n, i % n) != single.ray.tfar;
    differ += (RTCRayN_tfar(shadow(i), n, i % n) < 0) != is_hit(single.hit);
    differ += stream[i].hit.primID != single.hit.primID || stream[i].ray.tfar != single.ray.tfar;
  }
  return differ;
}
#endif

}  // namespace

int main() {
  RTCDevice device = new_device();
  Holes holes{0.3f};
  RTCScene one = scene_of(device, tile(device, holes));
  RTCScene five = ring(device, one, 5, 2.2f, 0.8f);
#if RTC_MAX_INSTANCE_LEVEL_COUNT > 1
  RTCScene world = ring(device, five, 3, 3.5f, 0.7f);
  constexpr float field = 1.0f;
#else
  RTCScene world = five; // Embree was built for one level.
  constexpr float field = 0.6f;
#endif

  constexpr int size = 256;
  const Vec eye = {0, -9, 5}, forward = normalize(Vec{0, 0, 0} - eye), right = normalize(cross(forward, {0, 0, 1})),
            up = cross(right, forward), light = normalize({0.4f, -0.3f, 0.9f});
  long hits = 0, shadowed = 0, differ = 0;
  std::vector<RTCRayHit> rays, traced;
  for (int y = 0; y < size; y++)
    for (int x0 = 0; x0 < size; x0 += lanes) {
      RTCRayHit single[lanes];
      RTCRayHit8 packet;
      alignas(32) int valid[lanes];
      for (int l = 0; l < lanes; l++) {
        const float a = field * ((x0 + l + 0.5f) / size - 0.5f), b = field * (0.5f - (y + 0.5f) / size);
        const Vec d = forward + a * right + b * up;
        single[l] = ray_at(&eye.x, &d.x);
        set_ray(packet.ray, l, single[l].ray);
        packet.hit.geomID[l] = packet.hit.primID[l] = RTC_INVALID_GEOMETRY_ID;
        // Every seventh lane is asleep.
        valid[l] = (x0 + l + y) % 7 ? -1 : 0;
      }
      intersect8(valid, world, packet);
      RTCRay8 shadows;
      RTCRayHit shadow[lanes];
      for (int l = 0; l < lanes; l++) {
        if (!valid[l]) {
          differ += packet.hit.geomID[l] != RTC_INVALID_GEOMETRY_ID;
          set_ray(shadows, l, single[l].ray);
          continue;
        }
        rays.push_back(single[l]);
        intersect1(world, &single[l], nullptr);
        traced.push_back(single[l]);
        const RTCHit &hit = single[l].hit;
        bool same = packet.hit.geomID[l] == hit.geomID && packet.hit.primID[l] == hit.primID &&
                    packet.ray.tfar[l] == single[l].ray.tfar;
        for (unsigned level = 0; same && is_hit(hit) && level < RTC_MAX_INSTANCE_LEVEL_COUNT; level++)
          same = packet.hit.instID[level][l] == hit.instID[level];
        same = same && (!is_hit(hit) || (packet.hit.u[l] == hit.u && packet.hit.v[l] == hit.v && packet.hit.Ng_x[l] == hit.Ng_x));
        differ += !same;
        hits += is_hit(hit);
        valid[l] = is_hit(hit) ? -1 : 0;
        const Vec p = eye + (0.9999f * single[l].ray.tfar) * Vec{single[l].ray.dir_x, single[l].ray.dir_y, single[l].ray.dir_z};
        shadow[l] = ray_at(is_hit(hit) ? &p.x : &eye.x, &light.x);
        set_ray(shadows, l, shadow[l].ray);
      }
      occluded8(valid, world, shadows);
      for (int l = 0; l < lanes; l++)
        if (valid[l]) {
          occluded1(world, &shadow[l].ray, nullptr);
          differ += (shadow[l].ray.tfar < 0) != (shadows.tfar[l] < 0);
          shadowed += shadow[l].ray.tfar < 0;
        }
    }
#if EMBREE_MAJOR == 3
  differ += streams(world, traced, rays);
#endif
  std::printf("%ld of %d rays hit, %ld of those in shadow, %ld hits cut out by the filter, %ld lanes unlike their single rays\n", hits,
              size * size, shadowed, holes.rejected.load(), differ);
  if (world != five)
    rtcReleaseScene(world);
  rtcReleaseScene(five);
  rtcReleaseScene(one);
  rtcReleaseDevice(device);
  return differ || !hits || !shadowed || !holes.rejected;
}
