/* Headers may be included in any order and twice, and keep their promise on the size of a query. */
#include <wis_wavelets.h>
#include <wis.h>
#include <wis.h>
#include <wis_lights.h>
#include <wis_lights.h>
#include <wis_wavelets.h>

typedef char query_is_192_bytes[sizeof(wis_wavelet_query) == 192 ? 1 : -1];

/* A use of each kind of declaration: constant, enumerator, struct, opaque type and function. */
int use_header(const wis_wavelet_light *environment, wis_wavelet_query *query);
int use_header(const wis_wavelet_light *environment, wis_wavelet_query *query) {
    float pdf = 0.0f;
    query->lobe[0].kind = WIS_WAVELET_LOBE_LAMBERT;
    return wis_wavelet_pdf(environment, 0, 0, 1, query->normal, 0, &pdf, 0) == WIS_OK;
}
