// Has File > Save Data begin with .vdi files where a VDI is selected. ParaView begins with what was saved
// last of the same type of data, at first .pvd, and a VDI's type is that of any image: a name without an
// extension would write all of the VDI's arrays as they are. What ParaView begins with for other images
// stays.
#ifndef pqVDISaveData_h
#define pqVDISaveData_h

#include <QObject>

class pqVDISaveData : public QObject {
  Q_OBJECT

 public:
  explicit pqVDISaveData(QObject* parent);

 protected:
  /// Of all objects: the dialog is ParaView's.
  bool eventFilter(QObject* watched, QEvent* event) override;
};

#endif
