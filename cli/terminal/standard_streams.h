// The three streams that a program begins with.
#pragma once

namespace kvx {

// Where the caller closed one, the next file that is opened takes its number: what is told there would be
// written into a scan, a lock or the database. Puts /dev/null in its place; reading from stdin and printing
// to stdout go on failing. For before anything else is opened.
void HoldStandardStreams();

}  // namespace kvx
