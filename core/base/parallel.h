#pragma once

#include <cstddef>
#include <functional>

namespace relume {

// Number of threads that ParallelFor uses in this process; 0 = one a core. Call early in main().
void SetThreadCount(int count);
int ThreadCount();

// Calls body(i0, i1) over disjoint ranges that cover [begin, end), of about `grain` items each, on
// several threads. Results must not depend on how the range is cut. Exceptions reach the caller.
void ParallelFor(std::size_t begin, std::size_t end, std::size_t grain,
                 const std::function<void(std::size_t, std::size_t)>& body);

}  // namespace relume
