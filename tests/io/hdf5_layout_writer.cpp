// Writes one clip and one result for hdf5_layout_test.py: hdf5_layout_writer CLIP.h5 RESULT.h5
#include <cstdio>

#include "io/source_clip.h"
#include "tests/io/result_test_content.h"

int main(int argument_count, char** arguments) {
    using namespace batchenc;
    if (argument_count != 3) return 2;
    const auto report = [](const Error& error) {
        std::fprintf(stderr, "%s\n", error.to_string().c_str());
        return 1;
    };
    // Every coordinate names its own place, so that a transposition shows: 100 f + 10 v + k.
    std::vector<float> positions;
    for (int f = 0; f < 4; ++f)
        for (int v = 0; v < 5; ++v)
            for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(100 * f + 10 * v + k));
    const std::vector<Triangle> triangles = {{0, 1, 2}, {2, 3, 4}};
    auto writer = ClipWriter::create(arguments[1], 4, 5, triangles, 24.0, "läufer", true);
    if (!writer) return report(writer.error());
    if (auto done = (*writer)->write_frames(0, {positions.data(), 4, 5}); !done) return report(done.error());
    if (auto done = (*writer)->finish(); !done) return report(done.error());
    const testing::ResultContent content;
    if (auto done = testing::write_result(arguments[2], content, true); !done) return report(done.error());
    return 0;
}
