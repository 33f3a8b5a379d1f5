// ParaView's colour maps and opacity functions, as proxies.
#ifndef VDIMaps_h
#define VDIMaps_h

class vtkSMProxy;

namespace pv {

/// Whether a colour map (`RGBPoints`) or opacity function (`Points`) has no range yet. If a user has set its
/// points, this marks the range as initialized, so that ParaView's own views leave the function alone, too.
bool waitsForRange(vtkSMProxy* function, const char* property);
/// The component that a colour map's legends name; vdi::magnitude if they name none.
int componentNamedBy(vtkSMProxy* map);
/// Whether ParaView may fit the colour map to the data.
bool mayRescale(vtkSMProxy* map);
/// The proxy in that property of `owner`; null if there is none, or no owner.
vtkSMProxy* proxyIn(vtkSMProxy* owner, const char* property);

}  // namespace pv

#endif
