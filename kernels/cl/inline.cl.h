// Functions that never become calls. Only they may take or give vectors of sixteen: those do not survive a
// call on every device, of which compilers warn even where there is none.
#define KVX_INLINE __attribute__((always_inline)) static
#if defined(__clang__) && defined(__has_warning)
#if __has_warning("-Wpsabi")  // else the pragma itself is warned of
#pragma clang diagnostic ignored "-Wpsabi"
#endif
#endif
