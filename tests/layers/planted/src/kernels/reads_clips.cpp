#include <fstream>

#include "../io/source_clip.h"
#  include "io/source_clip.h"
#include "quantizer.h"
#include <io/source_clip.h>
#include HIDDEN
