// Where compiled kernels are kept. Code is loaded from there, so nobody else may have a hand in it.
#pragma once
#include <filesystem>

namespace kvx {

// $KVX_KERNEL_CACHE, else kinevox/kernels in $XDG_CACHE_HOME, in ~/.cache, or, without a home folder to write
// to, in a folder of the user's own among the temporary ones. Empty where that one is not the user's alone:
// then nothing is kept.
std::filesystem::path DefaultProgramFolder();

// PoCL shows no device where it cannot keep what it compiles, as without a home folder, and goes to a folder
// that anybody may have made where none is named. Names it one by $POCL_CACHE_DIR unless the user did: its
// usual one where that can be written to, else among the temporary ones as above. For before its platform is
// first opened.
void GivePoclAFolder();

// PoCL ends the program where it cannot load a kernel. Throws Unavailable where it cannot from
// $POCL_CACHE_DIR, or where that has no room.
void RequirePoclsFolder();

// And where the disk of $POCL_CACHE_DIR is full while it compiles one.
bool PoclsFolderHasRoom();
void RequirePoclsRoom();  // throws Unavailable

}  // namespace kvx
