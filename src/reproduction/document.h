#pragma once

#include <string>
#include <vector>

#include "reproduction/ball_search.h"
#include "reproduction/curves.h"
#include "reproduction/differences.h"
#include "reproduction/picture_store.h"
#include "reproduction/plan.h"

namespace embrun {

/// A row of the tables, done both ways.
struct RowResult {
  Row row;
  PictureResult direct, mesh;
  PictureDifference difference;  ///< of the two
  /// Of the direct picture from the one mesh that figure 65 compares with: order 3, all refractions. None for others.
  std::optional<PictureDifference> from_reference;
};

/// Pictures side by side, or a figure that is none.
struct FigureFile {
  std::string file;  ///< relative to the document
  std::string caption;
};

struct Findings {
  std::vector<RowResult> rows;
  PictureResult thesis;  ///< the thesis's own tracer: view 2, n = 3
  BallSearchFigures search;
  std::vector<Curve> curves;         ///< figures 50 to 58
  std::vector<FigureFile> errors;    ///< figure 65
  std::vector<FigureFile> pictures;  ///< figures 62 to 64 and 66 to 68, and differences
  std::vector<std::string> notes;
};

/// The row that is so; aborts if there is none.
const RowResult& find_row(const Findings& findings, const Row& row);

/// The document, in Markdown.
std::string write_document(const Findings& findings, const ReproduceOptions& options);

/// Figure 65: mean square errors by the order (a) and by the number of refractions (b), on both views.
std::vector<Curve> error_curves(const Findings& findings);

}  // namespace embrun
