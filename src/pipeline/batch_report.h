#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "io/result_file.h"

namespace batchenc {

/// Wall time that clips spent in each stage, summed over the clips; more than the elapsed time when clips
/// overlap.
struct StageSeconds {
    double read = 0.0;
    double segment = 0.0;
    double code = 0.0;
    double verify = 0.0;
    double write = 0.0;

    StageSeconds& operator+=(const StageSeconds& other) {
        read += other.read;
        segment += other.segment;
        code += other.code;
        verify += other.verify;
        write += other.write;
        return *this;
    }
};

/// What became of one job.
struct JobReport {
    std::string name;
    std::filesystem::path output;
    std::optional<Error> error;     ///< nothing where the result stands
    bool kept = false;              ///< the result was there already (resume)
    ResultMetrics metrics;          ///< as in the result; empty after an error
    std::int64_t raw_bytes = 0;     ///< of the positions as float32: 12 x V x F
    std::int64_t result_bytes = 0;  ///< size of the result file; 0 after an error
    StageSeconds seconds;
};

/// What became of a batch: one report a job, in the order of the jobs.
struct BatchReport {
    std::vector<JobReport> jobs;

    bool all_done() const;     ///< no job has an error
    bool interrupted() const;  ///< some job was stopped on request
};

}  // namespace batchenc
