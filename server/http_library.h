// cpp-httplib as this program sets it up: every source that speaks HTTP includes it from here, so that all agree.
#pragma once
#define CPPHTTPLIB_LISTEN_BACKLOG 128
#define CPPHTTPLIB_RANGE_MAX_COUNT 16
#include <httplib.h>
