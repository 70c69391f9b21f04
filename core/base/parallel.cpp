#include "core/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <memory>

#include "core/base/resources.h"

namespace relume {
namespace {

std::unique_ptr<tbb::global_control>& Control() {
    static std::unique_ptr<tbb::global_control> control;
    return control;
}

}  // namespace

void SetThreadCount(int count) {
    if (count <= 0) {
        count = AvailableResources().cores;
    }
    Control() = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                      static_cast<std::size_t>(count));
}

int ThreadCount() {
    return static_cast<int>(
        tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void ParallelFor(std::size_t begin, std::size_t end, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body) {
    if (begin >= end) {
        return;
    }
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, grain > 0 ? grain : 1),
                      [&](const tbb::blocked_range<std::size_t>& r) { body(r.begin(), r.end()); });
}

}  // namespace relume
