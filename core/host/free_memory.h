// Gives memory that is free, but kept for later by the C library, back to the system.
#pragma once

namespace kvx {

// Between large steps: what one leaves in pieces would otherwise count beside all that the next one takes.
void ReturnFreeMemory();

}  // namespace kvx
