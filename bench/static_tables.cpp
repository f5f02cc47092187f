// Tables 8.2 to 8.5 and figures 8.3 to 8.6 of the thesis, as CSV on standard output: what tangential
// components and bending angles of static meshes cost by predictor, and by what the surface is fitted to.
//
// batchenc_static_tables table MESH…     one row a mesh, tangential and normal predictor
// batchenc_static_tables figures MESH…   one row a point of each plot
//
// Bits are those of an adaptive coder with two contexts, one for x and y and one for the angle (3.2.4);
// `coded` is the static coder's whole clip bitstream. "sphere" stands for an icosphere of 10,242 vertices.
// Times are of predicting and reconstructing alone.

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "codecs/clip_codec.h"
#include "io/mesh/mesh_file.h"
#include "kernels/bounding_box.h"
#include "kernels/range_coder.h"
#include "kernels/static_prediction.h"

namespace {

using namespace batchenc;

constexpr int kBits = 12;

struct Subject {
    std::string name;
    Mesh mesh;
    MeshTraversal traversal;
    Surface surface;
    PositionsView positions() const { return {mesh.positions.data(), 1, mesh.vertex_count()}; }
};

/// An icosahedron, each triangle cut in four `levels` times, on the unit sphere.
Mesh make_sphere(int levels) {
    const double g = (1.0 + std::sqrt(5.0)) / 2.0;
    std::vector<std::array<double, 3>> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                                 {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                                 {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    std::vector<Triangle> triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                       {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                       {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                       {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
        const auto middle = [&](std::int32_t a, std::int32_t b) {
            const auto [found, is_new] =
                middles.emplace(std::minmax(a, b), static_cast<std::int32_t>(points.size()));
            if (is_new) {
                const auto& p = points[static_cast<std::size_t>(a)];
                const auto& q = points[static_cast<std::size_t>(b)];
                points.push_back({p[0] + q[0], p[1] + q[1], p[2] + q[2]});
                auto& m = points.back();
                const double scale = std::sqrt((1.0 + g * g) / (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]));
                for (double& c : m) c *= scale;
            }
            return found->second;
        };
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : triangles) {
            const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            for (const Triangle& t :
                 {Triangle{a, ab, ca}, Triangle{b, bc, ab}, Triangle{c, ca, bc}, Triangle{ab, bc, ca}})
                finer.push_back(t);
        }
        triangles = std::move(finer);
    }
    Mesh mesh;
    for (const auto& p : points) {
        for (const double c : p) mesh.positions.push_back(static_cast<float>(c / std::sqrt(1.0 + g * g)));
    }
    mesh.triangles = std::move(triangles);
    return mesh;
}

struct Cost {
    double tangential = 0.0, normal = 0.0, rest = 0.0;  // bits a vertex; rest: vertices without a circle
    double fallbacks = 0.0;                             // of the angles asked for
    double microseconds = 0.0;                          // a vertex
};

Cost measure(const Subject& subject, const PredictionForm& form) {
    const BoundingBox box = bounding_box(subject.positions());
    const auto center = box.center();
    const double spacing = box.largest_side() / (1 << kBits) / kLatticeParts;
    const auto begin = std::chrono::steady_clock::now();
    StaticPrediction state(subject.traversal, subject.surface, form);
    std::array<std::vector<std::int32_t>, 3> values;
    for (std::size_t k = 0; k < subject.traversal.order.size(); ++k) {
        const float* p = subject.positions().at(0, subject.traversal.order[k]);
        VertexPrediction prediction = state.predict(k);
        std::array<double, 3> place;
        for (std::size_t c = 0; c < 3; ++c)
            place[c] = (static_cast<double>(p[c]) - static_cast<double>(center[c])) / spacing;
        const auto residuals = state.residuals_of(prediction, place);
        state.record(k, residuals, state.reconstruct(prediction, residuals));
        const bool splits = prediction.gate != nullptr;
        values[splits ? 0 : 2].push_back(residuals[0]);
        values[splits ? 0 : 2].push_back(residuals[1]);
        values[splits ? 1 : 2].push_back(residuals[2]);
    }
    const auto end = std::chrono::steady_clock::now();
    std::array<double, 3> bits{};
    const auto vertices = static_cast<double>(subject.mesh.vertex_count());
    for (std::size_t i = 0; i < 3; ++i) {
        RangeEncoder encoder;
        IntegerModel model;
        for (const std::int32_t value : values[i]) encoder.encode(model, value);
        bits[i] = 8.0 * static_cast<double>(encoder.finish().size()) / vertices;
    }
    Cost cost{bits[0], bits[1], bits[2], 0.0,
              std::chrono::duration<double, std::micro>(end - begin).count() / vertices};
    if (state.bending() && state.bending()->asked() > 0)
        cost.fallbacks =
            static_cast<double>(state.bending()->fell_back()) / static_cast<double>(state.bending()->asked());
    return cost;
}

double coded_bits(const Subject& subject, GeometryPredictor predictor, TangentialPredictor tangential) {
    CodecParameters parameters;
    parameters.method = CodecMethod::kStatic;
    parameters.bits = kBits;
    parameters.predictor = predictor;
    parameters.tangential = tangential;
    const auto clip =
        encode_clip(subject.positions(), subject.mesh.triangles, {}, parameters, SerialExecutor());
    return clip ? 8.0 * static_cast<double>(clip->bitstream.size()) /
                      static_cast<double>(subject.mesh.vertex_count())
                : 0.0;
}

constexpr GeometryPredictor kNormals[] = {GeometryPredictor::kToumaGotsman, GeometryPredictor::kHope,
                                          GeometryPredictor::kHopi, GeometryPredictor::kHops};

void print_table(const std::vector<Subject>& subjects) {
    fmt::print(
        "mesh,vertices,tangential,normal,tangential_bits,normal_bits,rest_bits,coded_bits,fallback_share,us_"
        "per_vertex\n");
    for (const Subject& subject : subjects) {
        for (const auto tangential : {TangentialPredictor::kParallelogram, TangentialPredictor::kMultiway,
                                      TangentialPredictor::kFitted, TangentialPredictor::kWeighted}) {
            for (const GeometryPredictor normal : kNormals) {
                const PredictionForm form{normal, 0, tangential, own_fit({}, normal)};
                const Cost cost = measure(subject, form);
                fmt::print("{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.4f},{:.2f}\n", subject.name,
                           subject.mesh.vertex_count(), to_name(tangential), to_name(normal), cost.tangential,
                           cost.normal, cost.rest, coded_bits(subject, normal, tangential), cost.fallbacks,
                           cost.microseconds);
            }
        }
        fmt::print("{},{},,auto,,,,{:.3f},,\n", subject.name, subject.mesh.vertex_count(),
                   coded_bits(subject, GeometryPredictor::kAuto, TangentialPredictor::kFitted));
    }
}

/// Bits of the angle, averaged over the subjects.
double mean_normal_bits(const std::vector<Subject>& subjects, GeometryPredictor normal,
                        const NormalFit& fit) {
    double sum = 0.0;
    for (const Subject& subject : subjects)
        sum += measure(subject, {normal, 0, TangentialPredictor::kParallelogram, fit}).normal;
    return sum / static_cast<double>(subjects.size());
}

void print_figures(const std::vector<Subject>& subjects) {
    fmt::print("figure,meshes,predictor,vertices,exponent,cosine,normal_bits\n");
    const auto row = [](const char* figure, const std::string& meshes, const std::vector<Subject>& of,
                        GeometryPredictor normal, const NormalFit& fit) {
        fmt::print("{},{},{},{},{:.2f},{:.2f},{:.4f}\n", figure, meshes, to_name(normal), fit.vertices,
                   fit.exponent, fit.cosine, mean_normal_bits(of, normal, fit));
        std::fflush(stdout);
    };
    // Figures 8.3 to 8.5 are of the first mesh, 8.6 of all.
    const std::vector<Subject> first(subjects.begin(), subjects.begin() + 1);
    for (const GeometryPredictor normal :
         {GeometryPredictor::kToumaGotsman, GeometryPredictor::kHope, GeometryPredictor::kHopi}) {
        const NormalFit own = own_fit({}, normal);
        for (int e = 0; e <= 16; ++e)
            row("8.3", first[0].name, first, normal,
                {own.vertices, 0.25f * static_cast<float>(e), own.cosine});
        for (int n = 4; n <= 40; n += 2)
            row("8.4", first[0].name, first, normal, {n, own.exponent, own.cosine});
        for (int c = 0; c <= 19; ++c)
            row("8.5", first[0].name, first, normal,
                {own.vertices, own.exponent, 0.05f * static_cast<float>(c)});
    }
    row("8.6", "all", subjects, GeometryPredictor::kToumaGotsman,
        own_fit({}, GeometryPredictor::kToumaGotsman));
    for (const float exponent : {0.5f, 0.9f, 1.3f, 1.7f, 2.1f}) {
        for (const int n : {6, 8, 10, 12, 14, 16, 18, 20, 24, 28})
            row("8.6", "all", subjects, GeometryPredictor::kHope, {n, exponent, 0.5f});
    }
}

}  // namespace

int main(int count, char** arguments) {
    const std::string what = count > 2 ? arguments[1] : "";
    if (what != "table" && what != "figures") {
        fmt::print(stderr, "usage: batchenc_static_tables table|figures MESH...\n");
        return 2;
    }
    std::vector<Subject> subjects;
    for (int i = 2; i < count; ++i) {
        const std::filesystem::path path = arguments[i];
        Subject subject{.name = path.stem().string(), .mesh = {}, .traversal = {}, .surface = {}};
        if (path == "sphere") {
            subject.mesh = make_sphere(5);
        } else {
            auto mesh = read_mesh(path);
            if (!mesh) {
                fmt::print(stderr, "{}\n", mesh.error().to_string());
                return 1;
            }
            subject.mesh = std::move(*mesh);
        }
        subject.traversal = MeshTraversal::of(subject.mesh.triangles, subject.mesh.vertex_count());
        subject.surface = Surface::of(subject.traversal.in_places(subject.mesh.triangles));
        subjects.push_back(std::move(subject));
    }
    if (what == "table")
        print_table(subjects);
    else
        print_figures(subjects);
    return 0;
}
