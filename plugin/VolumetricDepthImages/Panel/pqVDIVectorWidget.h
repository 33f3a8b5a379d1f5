// The property widget `vdi_vector`: the numbers of a vector below its label, over the whole width of the
// panel. ParaView's own widget puts three numbers beside the label, where six digits don't fit.
#ifndef pqVDIVectorWidget_h
#define pqVDIVectorWidget_h

#include <pqPropertyWidget.h>

class pqVDIVectorWidget : public pqPropertyWidget {
  Q_OBJECT

 public:
  pqVDIVectorWidget(vtkSMProxy* proxy, vtkSMProperty* property, QWidget* parent = nullptr);
  ~pqVDIVectorWidget() override;
};

#endif
