#pragma once
#include <H5Fpublic.h>
#include <spdlog/spdlog.h>
#include <yaml-cpp/yaml.h>

#include "codecs/runs_graph.h"
