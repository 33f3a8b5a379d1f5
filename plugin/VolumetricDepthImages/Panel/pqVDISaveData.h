// Makes File > Save Data offer .vdi files first if a VDI is selected. ParaView offers the extension last used
// for the same type of data, at first .pvd, and a VDI has the type of any image. A name without an extension
// would then write all of the VDI's arrays as they are. Other images keep ParaView's first offer.
#ifndef pqVDISaveData_h
#define pqVDISaveData_h

#include <QObject>

class pqVDISaveData : public QObject {
  Q_OBJECT

 public:
  explicit pqVDISaveData(QObject* parent);

 protected:
  /// Watches all objects, because ParaView owns the dialog.
  bool eventFilter(QObject* watched, QEvent* event) override;
};

#endif
