// Similarity of the template carried into a scan's pose and the scan (paper, Tables 2 to 4).
#pragma once

namespace kvx {

struct Measures {
  double ssd = 0;  // root mean square intensity difference on a 0..255 scale
  double cc = 0;   // correlation coefficient
  double mi = 0;   // mutual information in nats, 64 x 64 bins (eq. 5)
  bool operator==(const Measures&) const = default;
};

}  // namespace kvx
