#pragma once
#include <cblas.h>
#include <hdf5.h>
#include <tbb/flow_graph.h>
#include <CLI/CLI.hpp>
#include <boost/any.hpp>

#include "app/progress.h"
#include "io/source_clip.h"
