// Regenerates the VDI of one VolumetricDepthImage without making the window wait: after an edit of a colour
// map or opacity function, from a view's camera, and by itself while the filter's Auto is on.
//
// While a map is being edited, the filter is held: it shows its last VDI. Once the edit has rested and no
// mouse button is down, a thread makes the new VDI, which then replaces the old one. The same happens when a
// view asks for a VDI that isn't made yet, after Apply, Undo or with another time step. The view shows the
// last VDI meanwhile, unless a picture is taken of it, an animation is playing, or it is a comparative view.
//
// An input that changes with each update makes each VDI out of date before a view can show it. After five of
// them, this object stops until a user does something.
#ifndef pqVDIRegenerator_h
#define pqVDIRegenerator_h

#include <pqView.h>
#include <QElapsedTimer>
#include <QList>
#include <QObject>
#include <QPointer>
#include <QTimer>

#include <array>
#include <vector>

class pqPipelineSource;
class pqProxy;
class vtkSMRenderViewProxy;
class vtkSMVDIGeneratorProxy;

class pqVDIRegenerator : public QObject {
  Q_OBJECT

 public:
  /// `source` is a VolumetricDepthImage, which owns this object.
  explicit pqVDIRegenerator(pqPipelineSource* source);
  ~pqVDIRegenerator() override;

  /// Call it just before the panel applies: the next update is for a view.
  void applies();
  /// Regenerates the VDI from the camera of the view, at its size. Returns "", or the reason why it can't.
  QString regenerate(pqView* view);
  /// The regenerator of a proxy; null if the proxy is no VolumetricDepthImage in the pipeline.
  static pqVDIRegenerator* of(vtkSMVDIGeneratorProxy* proxy);
  /// The view whose camera Auto follows: the view that was active when Auto was turned on. If that view
  /// didn't show the VDI, or has been closed, it is the first active view that does; null before there is
  /// one.
  pqView* autoView() const { return this->AutoView; }
  /// What `noted` said last.
  const QString& lastNote() const { return this->Note; }

 Q_SIGNALS:
  /// What the panel says of the VDI being made, or of the picture that the views show of it; "" if there is
  /// nothing more to come.
  void noted(const QString& note);
  void autoViewChanged();

 protected:
  /// Watches for a user's keys and mouse buttons, after which a VDI is tried again.
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  Q_SLOT void watchMaps();
  Q_SLOT void mapChanged();
  Q_SLOT void look();
  Q_SLOT void lookAtViews();
  Q_SLOT void autoChanged();
  Q_SLOT void croppingChanged();
  Q_SLOT void leaveToUser();
  Q_SLOT void stateChanged();
  Q_SLOT void viewAdded(pqView* view);
  Q_SLOT void beginRender();
  Q_SLOT void endRender();
  Q_SLOT void lookWhetherViewsWait();
  Q_SLOT void proxyAdded(pqProxy* proxy);
  Q_SLOT void viewUpdated();
  Q_SLOT void drawSoon();
  Q_SLOT void lookWhatIsShown();

  enum class State { Idle, Waiting, Preparing };

  vtkSMVDIGeneratorProxy* generator() const;
  bool isUsed() const;
  bool isShownIn(pqView* view) const;
  void followShown(pqView* view);
  QList<pqView*> comparativeViews() const;
  void setAutoView(pqView* view);
  /// The proxy of autoView, if that shows the VDI; null otherwise.
  vtkSMRenderViewProxy* followedView();
  int preparation();
  void hold(int restMilliseconds);
  void finish();
  void stop();
  void note(const QString& text);
  void forgetMaps();

  pqPipelineSource* Source;
  State Now = State::Idle;
  QTimer Looking;                  // runs unless Now is Idle
  QTimer LookingAtViews;           // watches cameras for Auto
  QTimer Showing;                  // runs while views have yet to show the last VDI in full
  QList<QPointer<pqView>> ToDraw;  // views that haven't been drawn since there was another VDI
  QString Note;                    // what `noted` said last
  int Restarts = 0;                // VDIs in a row that were made in vain, without a user's doing
  QElapsedTimer Resting;           // time since the last edit
  qint64 Rest = 0;                 // milliseconds that an edit must rest
  bool IsAuto = false;             // the last value of Auto
  QPointer<pqView> AutoView;
  std::array<double, 10> LastCamera{};
  bool Defers = false;      // true if views don't wait
  bool IsPlaying = false;   // an animation is playing
  bool IsCaptured = false;  // a picture is being taken of a view
  bool Tried = false;       // true once a VDI was begun for the camera at rest, or the user has decided
  struct Watched;
  std::vector<Watched> Maps;
};

#endif
