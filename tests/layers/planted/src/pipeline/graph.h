#pragma once
#include <CLI/CLI.hpp>
#include <cblas.h>
#include <hdf5.h>
#include <tbb/flow_graph.h>
#include <boost/any.hpp>

#include "app/progress.h"
#include "io/source_clip.h"
