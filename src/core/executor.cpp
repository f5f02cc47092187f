#include "core/executor.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace batchenc {

void SerialExecutor::for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const {
    for (std::int64_t i = 0; i < count; ++i) function(i);
}

void ShuffledExecutor::for_each(std::int64_t count, const std::function<void(std::int64_t)>& function) const {
    std::vector<std::int64_t> order(static_cast<std::size_t>(std::max<std::int64_t>(count, 0)));
    std::iota(order.begin(), order.end(), std::int64_t{0});
    std::mt19937_64 random(seed_);
    std::shuffle(order.begin(), order.end(), random);
    for (const std::int64_t i : order) function(i);
}

}  // namespace batchenc
