#include "core/executor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <stdexcept>
#include <vector>

namespace batchenc {
namespace {

std::vector<std::int64_t> order_of(const Executor& executor, std::int64_t count) {
    std::vector<std::int64_t> order;
    executor.for_each(count, [&](std::int64_t i) { order.push_back(i); });
    return order;
}

std::vector<std::int64_t> first_integers(std::int64_t count) {
    std::vector<std::int64_t> numbers(static_cast<std::size_t>(count));
    std::iota(numbers.begin(), numbers.end(), std::int64_t{0});
    return numbers;
}

TEST(SerialExecutor, RunsInOrder) { EXPECT_EQ(order_of(SerialExecutor(), 100), first_integers(100)); }

TEST(ShuffledExecutor, CoversEachIndexOnce) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        auto order = order_of(ShuffledExecutor(seed), 100);
        std::sort(order.begin(), order.end());
        EXPECT_EQ(order, first_integers(100)) << seed;
    }
}

TEST(ShuffledExecutor, OrderDependsOnTheSeedAlone) {
    std::set<std::vector<std::int64_t>> orders;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        orders.insert(order_of(ShuffledExecutor(seed), 100));
        EXPECT_EQ(order_of(ShuffledExecutor(seed), 100), order_of(ShuffledExecutor(seed), 100));
    }
    EXPECT_EQ(orders.size(), 10u);
    EXPECT_FALSE(orders.contains(first_integers(100)));
}

TEST(Executors, CallNothingForNoWork) {
    for (const std::int64_t count : {0, -1}) {
        EXPECT_TRUE(order_of(SerialExecutor(), count).empty());
        EXPECT_TRUE(order_of(ShuffledExecutor(1), count).empty());
    }
}

TEST(Executors, PassExceptionsOn) {
    const auto throws = [](std::int64_t i) {
        if (i == 3) throw std::runtime_error("three");
    };
    EXPECT_THROW(SerialExecutor().for_each(10, throws), std::runtime_error);
    EXPECT_THROW(ShuffledExecutor(5).for_each(10, throws), std::runtime_error);
}

}  // namespace
}  // namespace batchenc
