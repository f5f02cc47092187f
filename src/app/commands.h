#pragma once

#include <atomic>

#include "app/command_line.h"

namespace batchenc {

// The commands: each does its work, prints its results on stdout, logs what went wrong, and gives the exit
// code. stop: ends the work cleanly once it is true.

int run_command(const EncodeOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);
int run_command(const DecodeOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);
int run_command(const InfoOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);
int run_command(const VerifyOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);
int run_command(const ImportOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);
int run_command(const ExportOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);
int run_command(const SegmentOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);
int run_command(const SynthOptions& options, const CommonOptions& common, const std::atomic<bool>& stop);

}  // namespace batchenc
