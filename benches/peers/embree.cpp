// Embree on the inputs of compare.py: embree FOLDER MESH embree1|embree16 RAYS THREADS SECONDS
#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>
#include <vector>
#include <xmmintrin.h>

template <class T> std::vector<T> words(const std::string &path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  std::vector<T> found(static_cast<size_t>(file.tellg()) / sizeof(T));
  file.seekg(0);
  file.read(reinterpret_cast<char *>(found.data()), found.size() * sizeof(T));
  return found;
}

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void one_by_one(RTCScene scene, const float *ray, double *distance, size_t count) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (size_t i = 0; i < count; i++, ray += 6) {
    RTCRayHit hit{};
    hit.ray.org_x = ray[0], hit.ray.org_y = ray[1], hit.ray.org_z = ray[2];
    hit.ray.dir_x = ray[3], hit.ray.dir_y = ray[4], hit.ray.dir_z = ray[5];
    hit.ray.tfar = INFINITY, hit.ray.mask = ~0u, hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &hit);
    distance[i] = hit.ray.tfar;
  }
}

void by_sixteen(RTCScene scene, const float *ray, double *distance, size_t count, bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) int valid[16];
  alignas(64) RTCRayHit16 hit;
  for (size_t first = 0; first < count; first += 16) {
    for (size_t k = 0; k < 16; k++) {
      const float *r = ray + 6 * std::min(first + k, count - 1);
      valid[k] = first + k < count ? -1 : 0;
      hit.ray.org_x[k] = r[0], hit.ray.org_y[k] = r[1], hit.ray.org_z[k] = r[2];
      hit.ray.dir_x[k] = r[3], hit.ray.dir_y[k] = r[4], hit.ray.dir_z[k] = r[5];
      hit.ray.tnear[k] = 0, hit.ray.tfar[k] = INFINITY, hit.ray.time[k] = 0;
      hit.ray.mask[k] = ~0u, hit.ray.flags[k] = 0;
      hit.hit.geomID[k] = hit.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(valid, scene, &context, &hit);
    for (size_t k = 0; k < 16 && first + k < count; k++) distance[first + k] = hit.ray.tfar[k];
  }
}

int main(int, char **argument) {
  const std::string folder = argument[1], mesh = argument[2], engine = argument[3], set = argument[4];
  const int threads = std::atoi(argument[5]);
  const double min_seconds = std::atof(argument[6]);
  const auto vertices = words<float>(folder + "/" + mesh + ".vertices.f32");
  const auto triangles = words<unsigned>(folder + "/" + mesh + ".triangles.u32");
  const auto rays = words<float>(folder + "/" + set + ".rays.f32");
  const size_t count = rays.size() / 6, block = 4096;
  double start = seconds();
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void *to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, vertices.size() / 3);
  std::copy(vertices.begin(), vertices.end(), static_cast<float *>(to));
  to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size() / 3);
  std::copy(triangles.begin(), triangles.end(), static_cast<unsigned *>(to));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcCommitScene(scene);
  const double build = seconds() - start;
  std::vector<double> distances(count), times;
  double sum = 0;
  while (times.size() < 2 || sum < min_seconds) {
    std::atomic<size_t> next{0};
    auto work = [&] {
      _mm_setcsr(_mm_getcsr() | 0x8040); // Flush denormals to zero, as Embree's manual recommends.
      for (size_t first; (first = block * next++) < count;) {
        const size_t some = std::min(block, count - first);
        if (engine == "embree1") one_by_one(scene, &rays[6 * first], &distances[first], some);
        else by_sixteen(scene, &rays[6 * first], &distances[first], some, set == "scan");
      }
    };
    start = seconds();
    std::vector<std::thread> others;
    for (int k = 1; k < threads; k++) others.emplace_back(work);
    work();
    for (auto &other : others) other.join();
    times.push_back(seconds() - start);
    sum += times.back();
  }
  std::sort(times.begin(), times.end());
  std::ofstream(folder + "/" + engine + "." + mesh + "." + set + ".f64", std::ios::binary)
      .write(reinterpret_cast<const char *>(distances.data()), count * 8);
  std::printf("{\"mrays\": %.3f, \"build_s\": %.4f}\n", count / times[times.size() / 2] / 1e6, build);
}
