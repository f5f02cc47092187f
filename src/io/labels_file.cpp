#include "io/labels_file.h"

#include "io/hdf5/durable_file.h"
#include "io/hdf5/hdf5_handle.h"

namespace batchenc {

namespace {

using hdf5::Handle;

Expected<void> write_content(hid_t file, const LabelsContent& content) {
    for (auto done : {hdf5::write_attribute(file, "format", std::string("batchenc-labels")),
                      hdf5::write_attribute(file, "format_version", std::int64_t{1}),
                      hdf5::write_attribute(file, "source", content.source),
                      hdf5::write_attribute(file, "method", content.method),
                      hdf5::write_attribute(file, "first_frame", content.first_frame),
                      hdf5::write_attribute(file, "frame_count", content.frame_count),
                      hdf5::write_attribute(file, "average_deviation", content.average_deviation),
                      hdf5::write_vector(file, "labels", H5T_STD_I32LE, H5T_NATIVE_INT32,
                                         content.labels.data(), content.labels.size()),
                      hdf5::write_vector(file, "vertex_deviation", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT,
                                         content.vertex_deviation.data(), content.vertex_deviation.size()),
                      hdf5::write_vector(file, "cluster_deviation", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE,
                                         content.cluster_deviation.data(), content.cluster_deviation.size())})
        if (!done) return done;
    auto seeds =
        hdf5::create_contiguous(file, "seed_triangles", H5T_STD_I32LE, {content.seed_triangles.size(), 3});
    if (!seeds) return tl::unexpected(seeds.error());
    if (H5Dwrite(seeds->get(), H5T_NATIVE_INT32, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                 content.seed_triangles.data()) < 0 ||
        !seeds->close())
        return fail(ErrorCode::kIo, hdf5::last_error("writing seed_triangles"));
    return {};
}

}  // namespace

Expected<void> write_labels(const std::filesystem::path& path, const LabelsContent& content, bool overwrite) {
    hdf5::prepare_thread();
    auto target = DurableFile::create(path, overwrite);
    if (!target) return tl::unexpected(target.error());
    auto file = hdf5::create_output(target->temporary_path());
    if (!file) return tl::unexpected(file.error());
    if (auto done = write_content(file->get(), content); !done)
        return fail_within(path.string(), std::move(done.error()));
    if (auto done = hdf5::close_output(*file, path.string()); !done) return done;
    return target->commit();
}

}  // namespace batchenc
