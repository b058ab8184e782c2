#define EMBRUN_CELL_MODEL cell_model_baseline
#include "geometry/cell_model_body.h"
