// cpp-httplib as this program sets it up: every source that speaks HTTP includes it from here.
// Its limits: cmake/KvxDependencies.cmake.
#pragma once
#include <httplib.h>
