// How a command that computes once and ends treats memory that it has freed.
#pragma once

namespace kvx {

constexpr int kBlocksOfABuild = 1 << 26, kBlocksOfAProduct = 1 << 30;  // bytes

// Keeps it for what comes next: the same large blocks are allocated again and again, and to get fresh pages
// for each costs an eighth of a build's time and a quarter of a pose's. Blocks of `largest_bytes` and more go
// back at once, and what one thread freed another takes, so that a build's peak stays low. Not for a
// service, which should give memory back. Does nothing where the C library is not glibc.
void KeepFreedMemory(int largest_bytes);

}  // namespace kvx
