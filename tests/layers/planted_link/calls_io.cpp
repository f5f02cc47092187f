// Breaks the include law on purpose: a kernel that reads a job file compiles, and must not link.
#include "io/job_file.h"

namespace batchenc {

bool planted_kernel_calls_io() { return read_job_file("job.yaml").has_value(); }

}  // namespace batchenc
