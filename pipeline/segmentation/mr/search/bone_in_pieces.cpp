// A ball in the middle of every closed blob is a stroke of its own for a search, all other bones are
// background; what is found must be about as large as the blob.
#include "pipeline/segmentation/mr/search/bone_in_pieces.h"

#include <algorithm>
#include <cmath>

#include "core/voxels/components.h"
#include "core/voxels/dilated.h"
#include "core/voxels/label_mask.h"
#include "pipeline/segmentation/mr/levels/marrow_level.h"
#include "pipeline/segmentation/mr/search/clearest_bone.h"
#include "pipeline/segmentation/mr/search/closed_blobs.h"
#include "pipeline/segmentation/mr/search/farther.h"
#include "pipeline/segmentation/mr/search/stroke_search.h"
#include "pipeline/segmentation/mr/shells/outward_rise.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

// Of a blob that is to be a piece: of any, of one that a stroke marks, of one that was found already.
struct Closed {
  double closed, aside;
  bool Holds(const ClosedBlob& blob) const { return blob.closed >= closed && blob.aside <= aside; }
};
constexpr Closed kUnmarked{0.95, 0.12}, kMarked{0.85, 0.25}, kFound{0.9, 0.15};

constexpr double kInside = 0.8;                         // of the radius: surely in the blob
constexpr double kBall = 0.5;                           // of the radius: taken for strokes
constexpr double kLeastFound = 0.7, kMostOthers = 0.1;  // shares of what is surely in the blob
constexpr double kBesideVoxels = 2;
constexpr double kLeastSize = 0.6, kMostSize = 3;  // of a ball of the blob's radius, which ends in the wall
constexpr size_t kMostBlobs = 200;                 // labels of strokes

class Pieces {
 public:
  Pieces(const MarkedScan& marked, const FoundBone& bone, const LabelMap& found, double marrow_level)
      : marked_(marked), bone_(bone), found_(found), marrow_level_(marrow_level) {
    const Grid& grid = marked.scan.grid;
    const VoxelBox mask = BoxOf(bone.mask);
    const VoxelBox own{mask.low + bone.box.low, mask.high + bone.box.low};
    most_mm_ = DiagonalMm(BoxOf(marked.strokes, bone.label), grid) / 2;  // a piece is smaller than the bone
    box_ = GrownByMm(own, 2 * most_mm_, grid);
    relative_ = Cropped(marked.scan, box_);
    for (float& r : relative_.values) r = float(r / marrow_level);
    labels_ = Cropped(found, box_), strokes_ = Cropped(marked.strokes, box_);
    own_ = MaskOfLabel(labels_, bone.label);
  }

  // Whether walls part its strokes.
  bool AreSeveral() const {
    std::vector<Eigen::Vector3d> parted;
    for (const ClosedBlob& blob : FindClosedBlobs(relative_, own_, most_mm_)) {
      if (!kFound.Holds(blob)) continue;
      const Shares shares = SharesOf(blob);
      if (!shares.marked || shares.own < kLeastFound) continue;
      if (std::ranges::all_of(parted,
                              [&](const auto& other) { return IsWalled(relative_, other, blob.centre_mm); }))
        parted.push_back(blob.centre_mm);
    }
    return parted.size() > 1;
  }

  BoneInPieces Answers(double clear_rise) const {
    BoneInPieces out;
    FoundBone with = bone_, pieces = bone_;
    std::ranges::fill(pieces.mask.values, uint8_t(0));
    for (const FoundBone& piece : Grown(Beside(), clear_rise)) {
      with = WithEnds(with, piece, marked_.calm, marrow_level_, clear_rise);
      const FoundBone taken = PartIn(with, piece);
      pieces = WithEnds(pieces, taken, marked_.calm, marrow_level_, -1);
      out.unmarked += IsNew(piece) && 2 * Count(taken.mask) > Count(piece.mask);
    }
    FoundBone sure = with;
    sure.mask = WithoutBareRest(with, pieces.mask);
    out.answers.push_back(std::move(with)), out.answers.push_back(std::move(sure));
    return out;
  }

 private:
  static double Count(const Mask& mask) { return double(std::ranges::count(mask.values, uint8_t(1))); }

  // What of a piece is in a bone, whose box holds the piece's.
  static FoundBone PartIn(const FoundBone& bone, FoundBone piece) {
    ForEachVoxel(
        {piece.box.low - bone.box.low, piece.box.high - bone.box.low}, bone.mask.grid,
        [&](const auto&, size_t part, size_t whole) { piece.mask.values[part] &= bone.mask.values[whole]; });
    return piece;
  }

  // Most of it was not found, and no stroke lies in it.
  bool IsNew(const FoundBone& piece) const {
    double found = 0, marks = 0;
    ForEachVoxel(piece.box, found_.grid, [&](const auto&, size_t part, size_t whole) {
      if (!piece.mask.values[part]) return;
      found += found_.values[whole] == bone_.label;
      marks += marked_.strokes.values[whole] == bone_.label;
    });
    return marks == 0 && found < Count(piece.mask) / 2;
  }

  // 1 for those with not much fewer strokes than the bone has everywhere.
  static std::vector<uint8_t> WellMarked(const Components& parts, const Mask& strokes, const Mask& bone) {
    constexpr double kOfUsual = 0.3;
    const double usual = Count(strokes) / std::max(Count(bone), 1.0);
    std::vector<double> marks(parts.voxels.size());
    for (size_t v = 0; v < strokes.values.size(); ++v) {
      if (strokes.values[v] && parts.piece.values[v] >= 0) ++marks[size_t(parts.piece.values[v])];
    }
    std::vector<uint8_t> well(marks.size());
    for (size_t n = 0; n < well.size(); ++n) well[n] = marks[n] >= kOfUsual * usual * double(parts.voxels[n]);
    return well;
  }

  // What neither is a piece nor holds strokes of its own leaked out between them.
  Mask WithoutBareRest(const FoundBone& bone, const Mask& pieces) const {
    const Mask near = Dilated(pieces);
    Mask rest = bone.mask, strokes(bone.mask.grid);
    ForEachVoxel(bone.box, marked_.scan.grid, [&](const auto&, size_t part, size_t whole) {
      rest.values[part] &= uint8_t(!near.values[part]);
      strokes.values[part] = marked_.strokes.values[whole] == bone_.label;
    });
    const Components parts = LabelComponents(rest);
    const Mask kept = Dilated(MaskOf(parts, WellMarked(parts, strokes, bone.mask)));
    Mask sure = pieces;
    for (size_t v = 0; v < sure.values.size(); ++v)
      sure.values[v] |= (kept.values[v] && bone.mask.values[v]) || strokes.values[v];
    return sure;
  }

  Eigen::Vector3d PlaceOf(size_t v) const {
    return relative_.grid.Ijk(v).cast<double>().cwiseProduct(relative_.grid.spacing_mm);
  }

  // Calls visit(index in the box) for the voxels of a ball.
  template <class Visit>
  void ForEachIn(const Eigen::Vector3d& centre_mm, double radius_mm, Visit&& visit) const {
    const Eigen::Array3d middle = centre_mm.array() / relative_.grid.spacing_mm.array(),
                         reach = radius_mm / relative_.grid.spacing_mm.array();
    const Eigen::Vector3i low = (middle - reach).floor().cast<int>(),
                          high = (middle + reach).ceil().cast<int>() + 1;
    ForEachVoxel({low.cwiseMax(0), high.cwiseMin(relative_.grid.size)}, relative_.grid,
                 [&](const auto&, size_t, size_t v) {
                   if ((PlaceOf(v) - centre_mm).norm() < radius_mm) visit(v);
                 });
  }

  struct Shares {
    double own = 0, others = 0;
    bool marked = false, marked_otherwise = false;
  };

  Shares SharesOf(const ClosedBlob& blob) const {
    Shares shares;
    double voxels = 0;
    ForEachIn(blob.centre_mm, kInside * blob.radius_mm, [&](size_t v) {
      const int label = labels_.values[v], stroke = strokes_.values[v];
      ++voxels;
      shares.own += label == bone_.label;
      shares.others += label != 0 && label != bone_.label;
      shares.marked |= stroke == bone_.label && relative_.values[v] >= kSurelyMarrow;
      shares.marked_otherwise |= stroke != 0 && stroke != bone_.label;
    });
    shares.own /= std::max(voxels, 1.0), shares.others /= std::max(voxels, 1.0);
    return shares;
  }

  bool IsBeside(const ClosedBlob& blob) const {
    bool beside = false;
    ForEachIn(blob.centre_mm, blob.radius_mm + kBesideVoxels * relative_.grid.MeanSpacingMm(),
              [&](size_t v) { beside |= labels_.values[v] == bone_.label; });
    return beside;
  }

  std::vector<ClosedBlob> Beside() const {
    std::vector<ClosedBlob> beside;
    for (const ClosedBlob& blob : FindClosedBlobs(relative_, Dilated(own_, most_mm_ / 2), most_mm_)) {
      if (beside.size() == kMostBlobs) break;
      const Shares shares = SharesOf(blob);
      if (!(shares.marked ? kMarked : kUnmarked).Holds(blob)) continue;
      if (shares.others <= kMostOthers && !shares.marked_otherwise && IsBeside(blob)) beside.push_back(blob);
    }
    return beside;
  }

  // The background's strokes, and all other bones.
  LabelMap Elsewhere() const {
    LabelMap marks(marked_.scan.grid);
    for (size_t v = 0; v < marks.values.size(); ++v) {
      const int stroke = marked_.strokes.values[v], label = found_.values[v];
      const bool other = (label != 0 && label != bone_.label) || (stroke != 0 && stroke != bone_.label);
      if (other) marks.values[v] = kBackgroundStroke;
    }
    return marks;
  }

  // Of the blobs, those that hold.
  std::vector<FoundBone> Grown(const std::vector<ClosedBlob>& blobs, double clear_rise) const {
    LabelMap marks = Elsewhere();
    for (size_t n = 0; n < blobs.size(); ++n) {
      ForEachIn(blobs[n].centre_mm, kBall * blobs[n].radius_mm, [&](size_t v) {
        const Eigen::Vector3i p = relative_.grid.Ijk(v) + box_.low;
        marks(p.x(), p.y(), p.z()) = uint16_t(n + 1);
      });
    }
    const std::vector<StrokeBox> boxes = StrokeBoxes(marks);
    std::vector<FoundBone> pieces;
    if (boxes.empty()) return pieces;
    for (std::vector<FoundBone>& answers :
         CutBonesFromStrokes(marked_.scan, marks, marked_.air, boxes, {.shell = true}, Progress{})) {
      FoundBone& piece = answers[ClearestBone(marked_.calm, marrow_level_, answers)];
      if (!HasSizeOf(blobs[size_t(piece.label - 1)], piece.mask) ||
          OutwardRise(marked_.calm, marrow_level_, piece.box, piece.mask) < clear_rise)
        continue;
      piece.label = bone_.label;
      for (float& lean : piece.lean.values) lean = std::min(lean, 1.0f);  // the ball is no stroke
      pieces.push_back(std::move(piece));
    }
    return pieces;
  }

  bool HasSizeOf(const ClosedBlob& blob, const Mask& piece) const {
    const double ball = 4 * kPi / 3 * std::pow(blob.radius_mm, 3) / piece.grid.spacing_mm.prod();
    return Count(piece) > kLeastSize * ball && Count(piece) < kMostSize * ball;
  }

  const MarkedScan& marked_;
  const FoundBone& bone_;
  const LabelMap& found_;
  const double marrow_level_;
  double most_mm_ = 0;
  VoxelBox box_;  // in the scan, of all below
  Mask own_;      // the bone
  Volume relative_;
  LabelMap labels_, strokes_;
};

}  // namespace

BoneInPieces AnswersInPieces(const MarkedScan& marked, const FoundBone& bone, const LabelMap& found,
                             double marrow_level, double clear_rise) {
  if (BoxOf(bone.mask).empty()) return {};
  const Pieces pieces(marked, bone, found, marrow_level);
  return pieces.AreSeveral() ? pieces.Answers(clear_rise) : BoneInPieces();
}

}  // namespace kvx
