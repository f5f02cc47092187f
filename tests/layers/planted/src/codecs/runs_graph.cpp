#include <oneapi/tbb/flow_graph.h>
#include <tbb/parallel_for.h>

#include "kernels/gone.h"
#include "kernels/quantizer.h"
#include "pipeline/graph.h"
