// twice.h compiled as C++.
#include "twice.h"
