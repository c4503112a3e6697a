// Ctrl-C, SIGTERM and a terminal that goes as a wish to stop: long work sees it through Progress and ends
// with Cancelled.
#pragma once

namespace kvx {

void CatchInterrupts();  // from now on; a second signal kills the program at once
bool InterruptRequested();
void ThrowIfInterrupted();  // Cancelled

}  // namespace kvx
