// What the handlers need of the pipeline: server/ fills these with the real thing, and nothing else of it is
// known here.
#pragma once
#include "api/builder_port.h"
#include "api/inspector_port.h"
#include "api/poser_port.h"
