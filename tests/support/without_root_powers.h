// What an account without root's powers may do, whoever runs the tests.
#pragma once
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <functional>
#include <thread>

namespace kvx::testing_support {

// Root may read and write everything, unless a thread gives that up: `act` runs on one that has, and what it
// starts may no more. An account that is not root has nothing to give up.
inline void WithoutRootPowers(const std::function<void()>& act) {
  std::thread([&] {
    for (const int power : {CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH}) ::prctl(PR_CAPBSET_DROP, power, 0, 0, 0);
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct powers[2] = {};
    ::syscall(SYS_capget, &header, powers);
    powers[0].effective &= ~(1u << CAP_DAC_OVERRIDE | 1u << CAP_DAC_READ_SEARCH);
    ::syscall(SYS_capset, &header, powers);
    act();
  }).join();
}

}  // namespace kvx::testing_support
