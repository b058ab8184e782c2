#pragma once

// What the benchmarks share: Google Benchmark's runs over recorded rays, and the medians of their times.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "measure/ray_recorder.h"

namespace embrun::bench {

/// Traces about `count` of the rays, evenly taken, once an iteration; tells the share of hits.
template <class Trace>
void run_rays(benchmark::State& state, const std::vector<SidedRay>& rays, std::size_t count, double& hit_share,
              const Trace& trace) {
  const std::size_t stride = std::max<std::size_t>(1, rays.size() / count);
  count = (rays.size() + stride - 1) / stride;
  for (auto _ : state) {
    std::size_t hits = 0;
    float sum = 0;
    for (std::size_t i = 0; i < rays.size(); i += stride) {
      SurfaceHit hit;
      if (!trace(rays[i], hit)) continue;
      ++hits;
      sum += hit.t + hit.shading_normal.x;
    }
    benchmark::DoNotOptimize(sum);
    hit_share = static_cast<double>(hits) / static_cast<double>(count);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
}

/// Collects the repetitions' CPU times, in seconds an iteration, and rates.
class Collector : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      std::string name = run.run_name.function_name;
      times_[name].push_back(run.cpu_accumulated_time / static_cast<double>(run.iterations));
      const auto items = run.counters.find("items_per_second");
      if (items != run.counters.end()) rates_[name].push_back(items->second);
    }
  }
  double seconds(const std::string& name) const { return median(times_, name); }
  double rate(const std::string& name) const { return median(rates_, name); }

 private:
  using Samples = std::map<std::string, std::vector<double>>;
  static double median(const Samples& samples, const std::string& name) {
    const auto found = samples.find(name);
    if (found == samples.end()) return 0;
    std::vector<double> sorted = found->second;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
  Samples times_, rates_;
};

inline const char* verdict(bool passed) { return passed ? "ok" : "BELOW"; }

/// The value of --name, taken out of the arguments; empty if it is not there.
inline std::string take_option(std::vector<char*>& arguments, const std::string& name) {
  for (std::size_t i = 1; i + 1 < arguments.size(); ++i) {
    if (name != arguments[i]) continue;
    const std::string value = arguments[i + 1];
    arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(i),
                    arguments.begin() + static_cast<std::ptrdiff_t>(i) + 2);
    return value;
  }
  return {};
}

/// Hands the rest of the arguments to Google Benchmark: seven interleaved repetitions unless they say otherwise. False when
/// it does not know one of them, which it has said then.
inline bool initialize(std::vector<char*>& arguments) {
  static std::array<std::string, 3> defaults{"--benchmark_enable_random_interleaving=true", "--benchmark_repetitions=7",
                                             "--benchmark_min_time=0.1"};
  for (std::string& option : defaults) arguments.insert(arguments.begin() + 1, option.data());
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  return !benchmark::ReportUnrecognizedArguments(count, arguments.data());
}

}  // namespace embrun::bench
