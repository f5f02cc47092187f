#include "codecs/field_coder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/mesh_topology.h"
#include "tests/support/sample_clips.h"

namespace batchenc {
namespace {

using enum FieldPredictor;
constexpr FieldPredictor kAll[] = {kParallelogram, kBlend, kMean, kHalf, kNone};

FieldOrder order_of(const MeshSequence& clip) {
    const std::vector<std::int32_t> one(static_cast<std::size_t>(clip.vertex_count), 0);
    const MeshTopology mesh(clip.triangles, clip.vertex_count);
    return mesh.is_points()
               ? FieldOrder::along_curve(std::span(clip.positions).first(3 * one.size()), one, 1)[0]
               : FieldOrder::of(mesh, one, 1)[0];
}

struct Field {
    FieldPredictor predictor;
    std::vector<std::int32_t> values;
};

std::vector<std::uint8_t> encode(const FieldOrder& order, std::vector<Field> fields) {
    BitCoder coder;
    FieldCoder fields_coder;
    FieldMemory memory(order.size());
    for (Field& field : fields) {
        const std::vector<std::int32_t> before = field.values;
        EXPECT_EQ(fields_coder.code(coder, order, memory, field.predictor, field.values), field.predictor);
        EXPECT_EQ(field.values, before);
    }
    EXPECT_EQ(memory.fields, static_cast<std::int32_t>(fields.size()));
    return coder.finish();
}

void expect_round_trip(const FieldOrder& order, const std::vector<Field>& fields) {
    const auto bytes = encode(order, fields);
    BitCoder coder(bytes);
    FieldCoder fields_coder;
    FieldMemory memory(order.size());
    for (const Field& field : fields) {
        std::vector<std::int32_t> values(field.values.size(), 99);
        EXPECT_EQ(fields_coder.code(coder, order, memory, kNone, values), field.predictor);
        EXPECT_EQ(values, field.values);
    }
    EXPECT_FALSE(coder.is_overrun());
    EXPECT_TRUE(coder.check_end());
}

TEST(FieldCoder, RoundTripsOverEveryKindOfClip) {
    std::mt19937 random(1);
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        SCOPED_TRACE(name);
        const FieldOrder order = order_of(clip);
        std::vector<Field> fields;
        for (const std::int32_t largest : {0, 1, 20, 5000, kLargestFieldValue / 2}) {
            for (const FieldPredictor predictor : kAll) {
                Field field{predictor, {}};
                for (std::int64_t k = 0; k < order.size(); ++k)
                    field.values.push_back(
                        static_cast<std::int32_t>(random() % (2u * static_cast<unsigned>(largest) + 1)) -
                        largest);
                fields.push_back(field);
            }
        }
        expect_round_trip(order, fields);
    }
}

TEST(FieldCoder, RoundTripsExtremesThatAlternate) {
    const FieldOrder order = order_of(test::sheet(9, 9, 1));
    std::vector<Field> fields;
    for (const FieldPredictor predictor : kAll) {
        Field field{predictor, {}};
        for (std::int64_t k = 0; k < order.size(); ++k)
            field.values.push_back(k % 3 == 0 ? -kLargestFieldValue / 2 : kLargestFieldValue / 2);
        fields.push_back(field);
    }
    expect_round_trip(order, fields);
}

/// Bytes of several fields alike.
std::size_t bytes_of(const FieldOrder& order, FieldPredictor predictor,
                     const std::vector<std::int32_t>& values) {
    return encode(order, std::vector<Field>(4, {predictor, values})).size();
}

// A field that is linear over a plain grid is what parallelograms say, but for the first few vertices.
TEST(FieldCoder, PredictsWhatItShould) {
    constexpr std::int64_t kSide = 30;
    const MeshSequence clip = test::sheet(kSide, kSide, 1);
    const FieldOrder order = order_of(clip);
    std::vector<std::int32_t> linear, constant, noise;
    std::mt19937 random(2);
    for (const std::int32_t v : order.vertices) {
        linear.push_back(static_cast<std::int32_t>(100 * (v % kSide) - 70 * (v / kSide)));
        constant.push_back(1000);
        noise.push_back(static_cast<std::int32_t>(random() % 200) - 100);
    }
    EXPECT_LT(4 * bytes_of(order, kParallelogram, linear), bytes_of(order, kMean, linear));
    EXPECT_LT(bytes_of(order, kMean, constant), 80u);
    EXPECT_LT(bytes_of(order, kParallelogram, constant), 80u);
    EXPECT_GT(bytes_of(order, kNone, constant), bytes_of(order, kMean, constant));
    for (const FieldPredictor predictor : {kParallelogram, kBlend, kMean})
        EXPECT_LT(bytes_of(order, kNone, noise), bytes_of(order, predictor, noise));
}

TEST(QuantizeField, ChoosesThePredictorAndStaysNear) {
    constexpr std::int64_t kSide = 30;
    const FieldOrder order = order_of(test::sheet(kSide, kSide, 1));
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    std::vector<float> linear, constant, noise;
    for (const std::int32_t v : order.vertices) {
        linear.push_back(100.4f * static_cast<float>(v % kSide) - 70.3f * static_cast<float>(v / kSide));
        constant.push_back(1000.0f + 0.6f * normal(random));
        noise.push_back(100.0f * normal(random));
    }
    std::vector<std::int32_t> values(linear.size());
    const auto expect_near = [&](const std::vector<float>& targets) {
        double sum = 0.0;
        for (std::size_t k = 0; k < values.size(); ++k) {
            const double d = static_cast<double>(values[k]) - static_cast<double>(targets[k]);
            EXPECT_LE(std::abs(d), 1.5);
            sum += d * d;
        }
        EXPECT_LE(std::sqrt(sum / static_cast<double>(values.size())), 0.5);
    };
    EXPECT_EQ(quantize_field(order, linear, values), kParallelogram);
    expect_near(linear);
    EXPECT_EQ(quantize_field(order, constant, values), kMean);
    expect_near(constant);
    EXPECT_EQ(quantize_field(order, noise, values), kNone);
    expect_near(noise);
}

TEST(FieldCoder, TakesAnyBytes) {
    std::mt19937 random(4);
    for (const auto& [name, clip] : test::every_kind_of_clip()) {
        const FieldOrder order = order_of(clip);
        for (int round = 0; round < 10; ++round) {
            std::vector<std::uint8_t> bytes(static_cast<std::size_t>(random() % 300));
            for (auto& b : bytes)
                b = round % 3 == 0 ? std::uint8_t{0xff} : static_cast<std::uint8_t>(random());
            BitCoder coder(bytes);
            FieldCoder fields;
            FieldMemory memory(order.size());
            std::vector<std::int32_t> values(order.vertices.size());
            for (int k = 0; k < 100 && !coder.is_overrun(); ++k) {
                fields.code(coder, order, memory, {}, values);
                for (const std::int32_t value : values) ASSERT_LE(std::abs(value), 2 * kLargestFieldValue);
            }
        }
    }
}

}  // namespace
}  // namespace batchenc
