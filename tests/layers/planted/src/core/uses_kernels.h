#pragma once
#include <vector>

#include "kernels/quantizer.h"
