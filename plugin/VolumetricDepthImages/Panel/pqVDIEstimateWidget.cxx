#include "pqVDIEstimateWidget.h"

#include <pqActiveObjects.h>
#include <pqCoreUtilities.h>
#include <vtkCommand.h>
#include <vtkSMProperty.h>
#include <vtkSMProxy.h>
#include <vtkSMSession.h>
#include <QLabel>
#include <QLocale>
#include <QVBoxLayout>

#include <optional>

#include "pqVDIRegenerator.h"
#include "vdi/core/Estimate.h"
#include "vdi/core/SettingsTable.h"
#include "vtkSMVDIGeneratorProxy.h"

namespace {

constexpr int soonMilliseconds = 50;

QString bytesText(double bytes) {
  return QLocale().formattedDataSize(static_cast<qint64>(bytes), 1);
}

QString secondsText(double seconds) {
  constexpr double least = 0.1;
  constexpr double many = 10.0;
  if (seconds < least) return QObject::tr("less than 0.1 s");
  return QObject::tr("%1 s").arg(QLocale().toString(seconds, 'f', seconds < many ? 1 : 0));
}

QString textOf(const vdi::VdiEstimate& estimate) {
  const QString memory = bytesText(estimate.bytesInMemory);
  const QString file = bytesText(estimate.bytesAsFile);
  if (!estimate.isFromLast) {
    return QObject::tr("Estimate for an average volume: %1 in memory (at most %2), %3 as a file")
        .arg(memory, bytesText(estimate.mostBytesInMemory), file);
  }
  const QString bytes =
      QObject::tr("Estimate from the last VDI: %1 in memory, %2 as a file").arg(memory, file);
  return estimate.seconds ? bytes + ", " + secondsText(*estimate.seconds) : bytes;
}

}  // namespace

pqVDIEstimateWidget::pqVDIEstimateWidget(vtkSMProxy* proxy, vtkSMProperty*, QWidget* parent)
    : pqPropertyWidget(proxy, parent), Line(new QLabel(this)) {
  this->setShowLabel(false);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  this->Line->setObjectName("EstimateLine");
  this->Line->setWordWrap(true);
  // The line keeps room for its longest text, so that nothing moves under the mouse.
  this->Line->setMinimumHeight(2 * this->Line->fontMetrics().lineSpacing());
  layout->addWidget(this->Line);
  this->Soon.setInterval(soonMilliseconds);
  this->Soon.setSingleShot(true);
  this->connect(&this->Soon, &QTimer::timeout, this, &pqVDIEstimateWidget::estimate);
  std::vector<const char*> names{"Resolution", "PictureOnly"};
  for (const vdi::Setting& setting : vdi::settingsTable()) names.push_back(setting.property);
  for (const char* name : names) {
    vtkSMProperty* property = proxy->GetProperty(name);
    for (const unsigned long event : {vtkCommand::UncheckedPropertyModifiedEvent, vtkCommand::ModifiedEvent})
      pqCoreUtilities::connect(property, event, &this->Soon, SLOT(start()));
  }
  pqCoreUtilities::connect(proxy, vtkCommand::UpdateDataEvent, &this->Soon, SLOT(start()));
  // The first Apply takes the active view's size.
  this->connect(&pqActiveObjects::instance(), &pqActiveObjects::viewChanged, &this->Soon,
                QOverload<>::of(&QTimer::start));
  if (auto* regenerator = pqVDIRegenerator::of(vtkSMVDIGeneratorProxy::SafeDownCast(proxy)))
    this->connect(regenerator, &pqVDIRegenerator::noted, &this->Soon, QOverload<>::of(&QTimer::start));
  this->estimate();
}

pqVDIEstimateWidget::~pqVDIEstimateWidget() = default;

void pqVDIEstimateWidget::estimate() {
  if (this->proxy()->GetSession()->GetPendingProgress()) {  // as in pv::mayAsk
    this->Soon.start();
    return;
  }
  auto* generator = vtkSMVDIGeneratorProxy::SafeDownCast(this->proxy());
  const std::optional<vdi::VdiEstimate> estimate =
      generator != nullptr ? generator->EstimateToCome() : std::nullopt;
  this->Line->setText(estimate ? textOf(*estimate) : QString());
}
