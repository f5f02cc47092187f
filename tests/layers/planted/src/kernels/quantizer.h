#pragma once
#include <hdf5.h>
#include <lapacke.h>
#include <thread>

#include <cstdint>
