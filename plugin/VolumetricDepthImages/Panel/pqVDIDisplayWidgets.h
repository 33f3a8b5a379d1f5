// Has the display panel hide what does nothing to a VDI: lights and places are in it already.
#ifndef pqVDIDisplayWidgets_h
#define pqVDIDisplayWidgets_h

#include <pqPropertyWidgetDecorator.h>
#include <pqPropertyWidgetInterface.h>
#include <QObject>

/// Of a widget of the display panel: hidden while the representation is VDI.
class pqVDIHiddenDecorator : public pqPropertyWidgetDecorator {
  Q_OBJECT

 public:
  explicit pqVDIHiddenDecorator(pqPropertyWidget* parent);

  bool canShowWidget(bool showAdvanced) const override;
};

/// ParaView asks it for the decorators of each widget of its panels.
class pqVDIDisplayWidgets : public QObject, public pqPropertyWidgetInterface {
  Q_OBJECT
  Q_INTERFACES(pqPropertyWidgetInterface)

 public:
  explicit pqVDIDisplayWidgets(QObject* parent = nullptr);

  void createDefaultWidgetDecorators(pqPropertyWidget* widget) override;
};

#endif
