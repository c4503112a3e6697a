// How many files a service may have open at the same time.
#pragma once

namespace kvx {

// Raises what the system grants at first, often 1024, as far as it lets us: 512 connections, each with a
// reader of the database and a file that is sent, need more.
void AllowManyOpenFiles();

}  // namespace kvx
