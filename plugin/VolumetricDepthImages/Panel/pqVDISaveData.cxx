#include "pqVDISaveData.h"

#include <pqActiveObjects.h>
#include <pqApplicationCore.h>
#include <pqFileDialog.h>
#include <pqOutputPort.h>
#include <pqServer.h>
#include <pqSettings.h>
#include <vtkDataObject.h>
#include <vtkPVDataInformation.h>
#include <vtkType.h>
#include <QApplication>
#include <QEvent>
#include <QTimer>
#include <QVariant>

#include "VDIServer.h"

namespace {

bool isVdiSelected() {
  pqOutputPort* port = pqActiveObjects::instance().activePort();
  if (port == nullptr || !pv::isConnected(port->getServer()->session())) return false;
  vtkPVDataInformation* data = port->getDataInformation();
  return data != nullptr && data->GetArrayInformation("VDI.offsets", vtkDataObject::FIELD) != nullptr;
}

/// The setting in which ParaView keeps the last extension for images.
QString settingOfImages() {
  return QString("extensions/SaveDataExtension/%1").arg(VTK_IMAGE_DATA);
}

void setForImages(const QVariant& extension) {
  pqApplicationCore* core = pqApplicationCore::instance();
  if (core == nullptr) return;
  if (extension.isValid()) {
    core->settings()->setValue(settingOfImages(), extension);
  } else {
    core->settings()->remove(settingOfImages());
  }
}

}  // namespace

pqVDISaveData::pqVDISaveData(QObject* parent) : QObject(parent) {
  QApplication::instance()->installEventFilter(this);
}

bool pqVDISaveData::eventFilter(QObject* watched, QEvent* event) {
  if (event->type() == QEvent::Show && watched->objectName() == "FileSaveDialog" && isVdiSelected()) {
    if (auto* dialog = qobject_cast<pqFileDialog*>(watched)) {
      dialog->setRecentlyUsedExtension("*.vdi");
      const QVariant before = pqApplicationCore::instance()->settings()->value(settingOfImages());
      // Runs after ParaView, which stores the extension as soon as the dialog has ended.
      this->connect(dialog, &QDialog::finished, this,
                    [this, before] { QTimer::singleShot(0, this, [before] { setForImages(before); }); });
    }
  }
  return QObject::eventFilter(watched, event);
}
